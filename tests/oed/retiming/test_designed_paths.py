"""Retiming of what a design looks like: series, strokes and moves with rests between them."""

import dataclasses

import numpy as np
import pytest

from oed.retiming import Toppra, limit_usage, plan_move, retime
from oed.retiming import path_speed as path_speed_module
from oed.retiming.path_speed import path_speed
from oed.retiming.paths import split_path
from oed.trajectories import FourierSeries, PiecewisePolynomial, Segment, Sequence
from robots.common.errors import InfeasibleError
from robots.signals import Motion

PERIOD = 0.004


def _experiment(limits, seed: int) -> Motion:
    """A ruckig move to the start of a random motion that rests at both ends, the motion, and a move back."""
    rng = np.random.default_rng(seed)
    coefficients = np.zeros((6, 5))
    # Velocities a cos + b sin of two harmonics: at rest where the a and the multiples of b cancel.
    size = rng.uniform(-0.5, 0.5, size=(2, 6, 1))
    coefficients[:, 1:3], coefficients[:, 3:] = size[0] * [1.0, -1.0], size[1] * [1.0, -0.5]
    series = FourierSeries.from_coefficients(coefficients, 0.1)
    first, last = series.sample(np.array([0.0, series.duration])).q
    parts = [Segment(kind="fourier", trajectory=series)]
    for kind, start, end in (("approach", np.full(6, 0.2), first), ("move", last, np.full(6, -0.3))):
        plan = plan_move(limits, start, end, period=PERIOD)
        move = PiecewisePolynomial(breakpoints=plan.breakpoints, coefficients=plan.coefficients)
        parts.insert(0 if kind == "approach" else len(parts), Segment(kind=kind, trajectory=move))
    return Sequence(segments=tuple(parts), period=PERIOD).motion()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_a_feasible_timing_never_becomes_slower(limits, seed):
    """Whatever keeps the limits is retimed, no slower, on exactly its path, within every limit."""
    given = _experiment(limits, seed)
    result = retime(given, limits, period=PERIOD)
    assert result.given_keeps_limits
    assert result.duration_after <= result.duration_before + 1e-9
    assert not result.slower
    assert "faster" in result.verdict()
    assert result.deviation < 1e-4
    # The given moves touch their limits by rounding.
    assert max(float(use.max()) for use in limit_usage(result.motion, limits).values()) <= 1.0 + 1e-6
    np.testing.assert_allclose(result.motion.q[[0, -1]], given.q[[0, -1]], atol=1e-12)


def test_time_optimal_moves_are_left_alone(limits):
    """A move that ruckig planned is as fast as its limits allow; retimed it is no slower."""
    plan = plan_move(limits, np.zeros(6), np.array([1.0, -0.5, 0.2, 0.9, 0.3, -2.0]), period=PERIOD)
    t = PERIOD * np.arange(round(plan.duration / PERIOD) + 1)
    result = retime(Motion(t, *plan.sample(t)), limits, period=PERIOD)
    assert result.duration_after <= plan.duration + 1e-9


@pytest.mark.slow
def test_a_failure_of_the_linear_programmes_is_survived(limits, monkeypatch):
    """Where TOPP-RA finds nothing on any grid, a smooth given timing is refined on its own."""
    given = _experiment(limits, 0)
    usual = retime(given, limits, period=PERIOD)

    def fail(*_):
        raise InfeasibleError("no luck")

    monkeypatch.setattr(path_speed_module, "_solve", fail)
    assert retime(given, limits, period=PERIOD).duration_after <= usual.duration_before
    with pytest.raises(InfeasibleError, match="no luck"):
        retime(np.array([[0.0] * 6, [1.0] * 6]), limits, period=PERIOD)


def test_another_grid_is_tried(limits, monkeypatch):
    """A grid on which the solver fails is replaced by another."""
    (piece,) = split_path(np.linspace(0.0, 1.0, 50)[:, None] * np.ones(6), limits.velocity)
    solve, grids = path_speed_module._solve, []

    def picky(path, constraints, grid, *others):
        grids.append(len(grid))
        if len(grids) < 3:
            raise InfeasibleError("no luck")
        return solve(path, constraints, grid, *others)

    monkeypatch.setattr(path_speed_module, "_solve", picky)
    grid, speed = path_speed(piece, limits, None, 500)
    assert len(grids) == 3
    assert len(grid) == len(speed) == grids[-1] == 751


@pytest.mark.slow
def test_a_given_timing_that_passes_a_limit_is_named(limits):
    """A timing too fast for the limits is made slower, and the verdict says which limit it had passed."""
    given = _experiment(limits, 1)
    fast = Motion(given.t / 20, given.q, given.dq * 20, given.ddq * 400)
    result = retime(fast, limits, period=PERIOD)
    assert result.given_keeps_limits is False
    assert result.slower
    assert "the given one uses" in result.summary()
    assert "limit of joint" in result.verdict()
    # Should a result ever be slower than a feasible timing, it says so plainly.
    feasible = {name: np.minimum(use, 1.0) for name, use in result.usage_before.items()}
    assert "keep it" in dataclasses.replace(result, usage_before=feasible).summary()


def test_torque_that_cannot_hold_the_arm_names_the_joint(limits):
    """Where gravity is beyond a torque limit on a part of the path, the joint is named."""

    def gravity(q, dq, ddq):
        return 30.0 * np.cos(q) + ddq

    with pytest.raises(InfeasibleError, match="joint 6: gravity"):
        retime(_experiment(limits, 2), limits, period=PERIOD, inverse_dynamics=gravity, options=Toppra(grid=500))
