"""The design problem: what every point of it keeps, and its exact gradient."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from oed.criteria import criterion
from oed.experiments.checks import usable_limits
from oed.experiments.problems.problem import FourierProblem
from robots.base_parameters import find_base_parameters
from robots.limits import Limits
from robots.regressor import default_model

QUANTITIES = ("lower", "upper", "velocity", "acceleration", "jerk")


@pytest.fixture(scope="module", params=["er3a", "prismatic", "single"])
def problem(request, robot_named) -> FourierProblem:
    robot = robot_named(request.param)
    model = default_model(robot, friction="coulomb-viscous", velocity_scale=0.02, offset=False)
    return FourierProblem(
        base=find_base_parameters(model), criterion=criterion("cond"), limits=usable_limits(robot.limits), samples=60
    )


def points(problem: FourierProblem, count: int) -> np.ndarray:
    return np.random.default_rng(0).normal(size=(count, problem.size))


def shares(problem: FourierProblem, z: np.ndarray, t: np.ndarray) -> np.ndarray:
    """The used share of each limit (5, n): 1 on the bound."""
    limits: Limits = problem.limits
    q, dq, ddq, dddq = problem.series(z).sample(t)
    half, middle = (limits.upper - limits.lower) / 2, (limits.upper + limits.lower) / 2
    bounds = (half, limits.velocity, limits.acceleration, limits.jerk)
    return np.array(
        [np.abs(x).max(axis=0) / bound for x, bound in zip((q - middle, dq, ddq, dddq), bounds, strict=True)]
    )


def test_rest_at_both_ends(problem: FourierProblem) -> None:
    """Every point, even a wild one, starts and ends at rest."""
    for z in points(problem, 20):
        _, dq, ddq, _ = problem.series(z).sample(np.array([0.0, problem.family.duration]))
        # Sums of ten terms of size ten.
        assert np.abs(dq).max() < 1e-12
        assert np.abs(ddq).max() < 1e-12


@pytest.mark.slow
def test_limits_hold_between_the_samples(problem: FourierProblem) -> None:
    """A point on the bound of the imposed rows keeps the limits on a 20 kHz grid, and wastes nearly nothing."""
    t = np.arange(0, problem.family.duration, 1 / 20_000)
    for z in points(problem, 5):
        used = shares(problem, problem.shrunk(100 * z), t)
        assert used.max() <= 1 + 1e-12
        # cos(pi N / M) with N = 5 harmonics and M = 250 samples is 0.998; each joint meets one of its limits.
        assert used.max(axis=0).min() > 0.998 - 1e-12


def test_shrinking(problem: FourierProblem) -> None:
    """What keeps the limits is left as it is; what does not keeps its shape, and goes as far as stated."""
    for z in points(problem, 5):
        kept = problem.shrunk(1e-3 * z)
        np.testing.assert_array_equal(kept, 1e-3 * z)
        on_bound, inside = problem.shrunk(100 * z), problem.shrunk(100 * z, 0.5)
        # Proportional to the given point on each joint, and half as far at half the fraction.
        ratio = (on_bound / z).reshape(problem.joints, -1)
        np.testing.assert_allclose(ratio, np.broadcast_to(ratio[:, :1], ratio.shape), rtol=1e-12)
        np.testing.assert_allclose(inside, on_bound / 2, rtol=1e-12)


def test_scaling(problem: FourierProblem) -> None:
    """Z = 0 rests in the middle of the ranges; an offset of one is half a range."""
    limits = problem.limits
    still = problem.series(np.zeros(problem.size)).sample(np.linspace(0, 10, 7))
    np.testing.assert_allclose(still.q, np.tile((limits.lower + limits.upper) / 2, (7, 1)), atol=1e-12)
    z = np.zeros((problem.joints, problem.size // problem.joints))
    z[:, 0] = 1.0
    np.testing.assert_allclose(problem.series(z.reshape(-1)).sample(np.zeros(1)).q[0], limits.upper, atol=1e-12)


@pytest.mark.parametrize("sharpness", [1.0, 16.0])
def test_gradient(problem: FourierProblem, sharpness: float) -> None:
    """The gradient by z, through eigenvalues and the reverse mode, follows central differences of the value."""
    random = np.random.default_rng(1)
    for z in points(problem, 3):
        z, direction = problem.shrunk(z, 0.8), random.normal(size=problem.size)
        _, gradient = problem.surrogate(z, sharpness)
        step = 1e-6
        ends = [problem.surrogate(z + s * step * direction, sharpness)[0] for s in (1, -1)]
        # tanh(dq / 0.02) has third derivatives of 1e5 where a joint turns: their share is 1e-12 * 1e5 of the slope.
        assert gradient @ direction == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=1e-4, abs=1e-5)


def test_pickles_without_its_code(problem: FourierProblem) -> None:
    """A problem goes to another process as data, and means the same there."""
    z = problem.shrunk(points(problem, 1)[0])
    expected = problem.cost(z)
    text = pickle.dumps(problem)
    assert pickle.loads(text).cost(z) == expected
    # The regressor's code and matrices would be megabytes.
    assert len(text) < 200_000
