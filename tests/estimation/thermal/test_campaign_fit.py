"""Rigid body, friction and heat fitted together, on a virtual arm whose heat is integrated by hand."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation.identifications.identification import identify
from estimation.thermal import (
    CampaignEstimate,
    ThermalTorqueModel,
    fit_campaign,
    fit_thermal,
    friction_signal,
    thermal_from_dict,
    thermal_runs,
)
from robots.common.errors import InputError, NotIdentifiableError
from robots.plants import nominal_plant
from robots.robot import Robot
from robots.signals import Log, Motion

pytestmark = pytest.mark.slow

PERIOD, NOISE = 0.02, 0.05
HEAT = (
    {"alpha": -0.012, "K1": 1.0, "K2": 1.2, "C1": 90.0, "C2": 700.0},
    {"alpha": -0.02, "K1": 0.6, "K2": 0.5, "C1": 40.0, "C2": 300.0},
)


def warm_up(
    robot: Robot, motion: Motion, minutes: float, start: np.ndarray, seed: int
) -> tuple[Motion, Log, np.ndarray]:
    """Repeats a motion on the arm, its heat by Euler's rule at the sample time, and logs it."""
    t = np.arange(0.0, 60.0 * minutes, PERIOD)
    index = np.arange(len(t)) % len(motion)
    q, dq, ddq = motion.q[index], motion.dq[index], motion.ddq[index]
    coefficients = np.asarray(robot.friction)
    cold = np.tanh(dq / 1e-3) * coefficients[:, 0] + dq * coefficients[:, 1]
    T, factor = start.copy(), np.empty_like(q)
    alpha, K1, K2, C1, C2 = (np.array([h[k] for h in HEAT]) for k in ("alpha", "K1", "K2", "C1", "C2"))
    power = cold * dq
    for k in range(len(t)):
        factor[k] = alpha * (T[:, 0] - 20.0) + 1.0
        through = K1 * (T[:, 0] - T[:, 1])
        T[:, 0] += PERIOD * (power[k] * factor[k] - through) / C1
        T[:, 1] += PERIOD * (through - K2 * (T[:, 1] - 20.0)) / C2
    plant = nominal_plant(robot)
    noise = np.random.default_rng(seed).normal(0.0, NOISE, q.shape)
    tau = plant.model.torque(q, dq, ddq, plant.parameters) + (factor - 1.0) * cold + noise
    return Motion(t, q, dq, ddq), Log(t=t, q=q, tau=tau, ambient=np.full(len(t), 20.0)), T


@pytest.fixture(scope="module")
def recorded(arm: Robot, fourier_motion: Callable[..., Motion]) -> tuple[Motion, Log]:
    """Half an hour of the arm from cold."""
    motion, log, _ = warm_up(arm, fourier_motion(arm, 0, 20.0, PERIOD), 30.0, np.full((2, 2), 20.0), 0)
    return motion, log


@pytest.fixture(scope="module")
def estimate(arm: Robot, recorded: tuple[Motion, Log]) -> CampaignEstimate:
    """All fitted together, from two logs with no pause between them."""
    log = recorded[1]
    return fit_campaign(arm, [log.rows(slice(0, 40000)), log.rows(slice(40000, None))])


def test_rigid_body_friction_and_heat_come_out_together(arm: Robot, estimate: CampaignEstimate) -> None:
    """Friction at T0 is that of the cold arm, and heat ratios are within their errors of the truth."""
    names = estimate.model.names
    errors = np.sqrt(np.diag(estimate.model.covariance))
    for joint, coefficients in enumerate(np.asarray(arm.friction), start=1):
        for k in (0, 1):
            i = names.index(f"f{k + 1}_{joint}")
            # Smoothing takes a little at the reversals, where the sign changes within milliseconds: half a percent.
            assert abs(estimate.model.values[i] - coefficients[k]) < 4.0 * errors[i] + 0.005 * coefficients[k]
    for fit, truth in zip(estimate.thermal, HEAT, strict=True):
        assert fit is not None
        for name in ("K1", "K2", "C1", "C2"):
            ratio = (fit["alpha"].value / fit[name].value) / (truth["alpha"] / truth[name])
            # Relative errors of K and C by convention are those of their ratio to alpha.
            assert abs(ratio - 1.0) < 4.0 * fit[name].standard_error / fit[name].value
    assert estimate.success
    assert estimate.rounds < 12


def test_heat_explains_what_one_friction_cannot(estimate: CampaignEstimate) -> None:
    """The residual comes down from that of one friction for cold and warm, at the second joint to the noise."""
    assert np.all(estimate.residual_rms < 0.7 * estimate.residual_without)
    assert estimate.residual_rms[1] < 1.1 * NOISE
    assert "slow / fast" in estimate.summary()
    # A ratio says what it is of, that it is one, and what its interval holds.
    assert "highest over lowest" in estimate.summary()
    assert "± 95 %" in estimate.summary()
    assert re.search(r" ± [0-9.]+ times\n", estimate.summary())
    assert set(estimate.to_frame()["joint"]) == {1, 2}
    assert estimate.to_dict()["success"]
    assert len(estimate.plot().get_lines()) == 4


def test_torque_is_predicted_cold_and_warm(
    arm: Robot, estimate: CampaignEstimate, fourier_motion: Callable[..., Motion]
) -> None:
    """Another motion, from cold and from warm, is predicted within 1.2 times the noise that the fit left."""
    model = estimate.torque_model
    for start in (np.full((2, 2), 20.0), np.array([[34.0, 30.0], [31.0, 28.0]])):
        motion, log, _ = warm_up(arm, fourier_motion(arm, 5, 20.0, PERIOD), 4.0, start, 1)
        # Conventions scale temperatures: a start is where the friction is the same.
        begins = []
        for j, thermal in enumerate(model.thermal):
            assert thermal is not None
            begins.append(20.0 + (start[j] - 20.0) * HEAT[j]["alpha"] / thermal.alpha)
        torque, paths = model.simulate(motion, start=begins)
        rms = np.sqrt(np.mean((log.tau - torque) ** 2, axis=0))
        moving = np.abs(motion.dq) > 0.02
        rms = np.array([np.sqrt(np.mean((log.tau - torque)[moving[:, j], j] ** 2)) for j in range(2)])
        assert np.all(rms < 1.2 * NOISE)
        for j, path in enumerate(paths):
            assert path is not None
            assert path.energy[-1] == pytest.approx(np.trapezoid(path.power, motion.t), rel=1e-9)
            np.testing.assert_allclose(
                model.torque(motion.q, motion.dq, motion.ddq, [p.temperatures[-1, 0] for p in paths])[-1],
                torque[-1],
                atol=1e-9,
            )
            assert model.thermal[j] is not None


def test_the_model_file_carries_the_heat(estimate: CampaignEstimate) -> None:
    """The plain data of a model with heat give it back; those of a model without give none."""
    data = estimate.torque_model.to_dict()
    back = thermal_from_dict(estimate.model, data)
    assert back is not None
    assert back.thermal == estimate.torque_model.thermal
    assert thermal_from_dict(estimate.model, estimate.model.to_dict()) is None
    with pytest.raises(InputError, match="thermal models"):
        ThermalTorqueModel(model=estimate.model, thermal=(None,))


def test_friction_from_logs_feeds_single_fits(
    arm: Robot, recorded: tuple[Motion, Log], estimate: CampaignEstimate
) -> None:
    """Subtracting an identified rigid body gives runs whose fit has the joint fit's time constants."""
    log = recorded[1]
    model = replace(identify(arm, log.rows(slice(0, 6000))).model)
    (run,) = thermal_runs(model, log, 2)
    found = fit_thermal(run, starts=1)
    together = estimate.thermal[1]
    assert together is not None
    slow, other = found.combinations[0], together.combinations[0]
    assert slow.value == pytest.approx(other.value, abs=4.0 * np.hypot(slow.standard_error, other.standard_error))
    signal = friction_signal(model, log)
    assert signal.friction.shape == signal.cold.shape == log.q.shape


def test_pauses_between_logs_are_rests(arm: Robot, recorded: tuple[Motion, Log], estimate: CampaignEstimate) -> None:
    """Two logs an hour apart are one run with a rest, a day apart they are two."""
    log = recorded[1]
    first, second = log.rows(slice(0, 6000)), log.rows(slice(0, 6000))
    for pause, count in ((3600.0, 1), (86400.0, 2)):
        later = replace(second, t=np.asarray(second.t) + pause)
        runs = thermal_runs(estimate.model, [later, first], 1)
        assert len(runs) == count
        if count == 1:
            longest = int(np.argmax(np.diff(runs[0].t)))
            assert runs[0].held_power[longest] == 0.0


def test_what_cannot_be_fitted_is_said(arm: Robot, recorded: tuple[Motion, Log], estimate: CampaignEstimate) -> None:
    """No logs, no such joint, and a joint that stands are named."""
    with pytest.raises(InputError, match="no logs"):
        fit_campaign(arm, [])
    log = recorded[1].rows(slice(0, 3000))
    with pytest.raises(InputError, match="joint 3"):
        thermal_runs(estimate.model, log, 3)
    still = Log(t=log.t, q=np.zeros_like(log.q), tau=log.tau)
    with pytest.raises(NotIdentifiableError, match="does not move"):
        thermal_runs(estimate.model, still, 1)
