"""Friction of one moving joint, by the single-axis model and from sweeps at constant speed."""

from __future__ import annotations

import numpy as np
import pytest

from estimation.thermal import fit_single_axis, sweep_friction
from estimation.thermal.runs.single_axis import constant_speeds
from robots.common.errors import InputError, NotIdentifiableError

J, QA, QB = 1.7, 22.0, -6.0
FORWARD, BACKWARD = np.array([8.0, 5.0, 0.4, -0.2]), np.array([9.5, 4.0, 0.1, 0.05])


def friction(v: np.ndarray, backward: np.ndarray = FORWARD) -> np.ndarray:
    """Thesis eq. 88, each direction with its own coefficients."""
    rows = np.where(v[:, None] >= 0, FORWARD, backward)
    return rows[:, 0] * np.sign(v) + rows[:, 1] * v + rows[:, 2] * v**2 * np.sign(v) + rows[:, 3] * v**3


def swings(seed: int = 0) -> tuple[np.ndarray, ...]:
    """A motion with several speeds both ways."""
    t = np.arange(0.0, 30.0, 0.01)
    rng = np.random.default_rng(seed)
    w, a = 2 * np.pi * np.array([0.1, 0.3, 0.4]), rng.uniform(0.6, 1.2, 3)
    q = np.sin(np.outer(t, w)) @ a
    return t, q, np.cos(np.outer(t, w)) @ (a * w), -np.sin(np.outer(t, w)) @ (a * w**2)


def sweep(speeds: tuple[float, ...]) -> tuple[np.ndarray, ...]:
    """Strokes of 2 rad both ways at constant speeds, ramps between."""
    v = np.concatenate(
        [
            np.concatenate([np.linspace(0, s, 20), np.full(int(2.0 / s / 0.01), s), np.linspace(s, 0, 20)]) * sign
            for s in speeds
            for sign in (1.0, -1.0)
        ]
    )
    t = 0.01 * np.arange(len(v))
    return t, -1.0 + np.cumsum(v) * 0.01, v


def test_the_single_axis_model_is_recovered() -> None:
    """J, Qa, Qb and a0..a3 of exact data come back to rounding, and of noisy data within their errors."""
    _, q, dq, ddq = swings()
    tau = J * ddq + QA * np.cos(q) - QB * np.sin(q) + friction(dq)
    exact = fit_single_axis(q, dq, ddq, tau)
    np.testing.assert_allclose([exact.J, exact.Qa, exact.Qb], [J, QA, QB], rtol=1e-9)
    np.testing.assert_allclose(exact.coefficients, [FORWARD, FORWARD], rtol=1e-7)
    noisy = fit_single_axis(q, dq, ddq, tau + np.random.default_rng(1).normal(0, 0.3, len(tau)))
    values = np.array([noisy.J, noisy.Qa, noisy.Qb, *noisy.coefficients[0]])
    # One of seven beyond 3.5 standard errors: a chance of 0.3 %.
    assert np.all(np.abs(values - [J, QA, QB, *FORWARD]) < 3.5 * noisy.standard_errors)
    assert noisy.residual_rms == pytest.approx(0.3, rel=0.05)


def test_directions_may_differ() -> None:
    """With coefficients for each direction, both sets are found; one set for both does not explain the data."""
    _, q, dq, ddq = swings()
    tau = J * ddq + QA * np.cos(q) - QB * np.sin(q) + friction(dq, BACKWARD)
    apart = fit_single_axis(q, dq, ddq, tau, each_direction=True)
    np.testing.assert_allclose(apart.coefficients, [FORWARD, BACKWARD], rtol=1e-6)
    np.testing.assert_allclose(apart.friction(dq) + apart.rigid(q, ddq), tau, atol=1e-8)
    assert fit_single_axis(q, dq, ddq, tau).residual_rms > 0.1


def test_sweeps_give_friction_without_gravity() -> None:
    """At each constant speed, both ways, friction comes out with gravity removed (eq. 84)."""
    t, q, v = sweep((0.3, 0.8, 1.5))
    rng = np.random.default_rng(2)
    tau = QA * np.cos(q) - QB * np.sin(q) + friction(v, BACKWARD) + rng.normal(0, 0.2, len(v))
    found = sweep_friction(t, q, v, tau)
    np.testing.assert_allclose(found.speed, [0.3, -0.3, 0.8, -0.8, 1.5, -1.5], rtol=0.02)
    expected = friction(found.speed, BACKWARD)
    # Six values within 3.5 standard errors: 0.3 % of failing wrongly.
    assert np.all(np.abs(found.friction - expected) < 3.5 * found.standard_error)
    assert found.Py == pytest.approx(QA, abs=0.5)
    assert found.Px == pytest.approx(-QB, abs=0.5)


def test_an_upright_axis_needs_no_gravity() -> None:
    """Without gravity the friction is the mean torque of each stretch."""
    t, q, v = sweep((0.5, 1.0))
    found = sweep_friction(t, q, v, friction(v), gravity=False)
    np.testing.assert_allclose(found.friction, friction(found.speed), rtol=1e-9)


def test_stretches_of_constant_speed_are_found() -> None:
    """Ramps and rests are no stretches; each constant speed is one."""
    _, _, v = sweep((0.3, 0.8))
    stretches = constant_speeds(v)
    assert len(stretches) == 4
    for stretch in stretches:
        assert np.ptp(np.abs(v[stretch])) < 0.02 * abs(v[stretch].mean())


def test_what_cannot_be_reported_is_said() -> None:
    """A single speed, no constant speed, and arrays of other shapes are named."""
    t, q, dq, ddq = swings()
    with pytest.raises(NotIdentifiableError, match="separately"):
        fit_single_axis(0.1 * t, np.ones(len(t)), np.zeros(len(t)) + 1e-3, np.ones(len(t)))
    with pytest.raises(NotIdentifiableError, match="constant speed"):
        sweep_friction(t, q, np.random.default_rng(0).normal(size=len(t)), ddq)
    with pytest.raises(InputError, match="shapes"):
        fit_single_axis(q, dq[:-1], ddq, q)
    with pytest.raises(InputError, match="finite"):
        fit_single_axis(q * np.nan, dq, ddq, q)
