"""What every local solver of design problems does, and that both arrive at the same optimum."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from oed.criteria import criterion
from oed.experiments import InteriorPoint, Ipopt, Slsqp, Solver, usable_limits
from oed.experiments.options import LimitOptions
from oed.experiments.problems.problem import FourierProblem
from oed.experiments.safety_checks.safety import choose_safety
from oed.experiments.solvers import Stage
from oed.experiments.solvers.curved_slacks import CurvedSlacks
from oed.experiments.solvers.slacks import LinearSlacks, implied
from oed.trajectories import Fourier
from robots.base_parameters import find_base_parameters
from robots.loading import load_robot
from robots.regressor import default_model

SOLVERS = (InteriorPoint(), Ipopt(), Slsqp())


@pytest.fixture(scope="module")
def problem() -> FourierProblem:
    base = find_base_parameters(default_model(load_robot("er3a"), friction="coulomb-viscous", velocity_scale=0.02))
    return FourierProblem(base=base, criterion=criterion("cond"), limits=usable_limits(base.model.robot.limits))


@pytest.fixture(scope="module")
def start(problem: FourierProblem) -> np.ndarray:
    rng = np.random.default_rng(3)
    return min((problem.shrunk(rng.normal(size=problem.size), 0.95) for _ in range(20)), key=problem.cost)


@pytest.mark.slow
@pytest.mark.parametrize("solver", SOLVERS, ids=lambda solver: solver.name)
def test_better_and_within(solver: Solver, problem: FourierProblem, start: np.ndarray) -> None:
    """A solution is far better than its start, within every limit, and counts what it cost."""
    solved = solver.minimise(problem, start, [Stage(sharpness=16, max_iter=60, barrier=solver.barriers[0])])
    assert problem.cost(solved.z) < 0.75 * problem.cost(start)
    # To rounding: rows that Bernstein's inequality implies are looked at, too.
    assert problem.rows.excess(problem.free(solved.z)).max() < 1e-9
    assert 0 < solved.iterations <= solved.evaluations


@pytest.mark.parametrize("solver", SOLVERS, ids=lambda solver: solver.name)
def test_stopped_within_the_limits(solver: Solver, problem: FourierProblem, start: np.ndarray) -> None:
    """Stopped at any moment, a solver has a design within all limits that is no worse than its start."""
    left = iter(range(5))
    solved = solver.minimise(
        problem,
        start,
        [Stage(sharpness=16, max_iter=60, barrier=solver.barriers[0])],
        tell=lambda sharpness, value: next(left, None) is not None,
    )
    assert solved.iterations <= 6
    assert problem.rows.excess(problem.free(solved.z)).max() < 1e-9
    if isinstance(solver, Slsqp):  # its iterates are not within the limits: if pulling does harm, it keeps its start
        assert problem.cost(solved.z) <= problem.cost(start)
    else:
        assert problem.cost(solved.z) < problem.cost(start)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("rival", "worse"),
    [(Ipopt(tolerance=1e-6), 0.1), (Slsqp(tolerance=1e-6), 0.3)],
    ids=lambda rival: getattr(rival, "name", ""),
)
def test_same_optimum(rival: Solver, worse: float, problem: FourierProblem, start: np.ndarray) -> None:
    """An oracle ends at nothing better: neither from a point near the optimum nor from where ours ended.

    By its rounding it may end at another optimum that is worse; SLSQP also by what pulling it within the limits costs.
    """
    smooth = replace(problem, criterion=criterion("d"))
    stage = Stage(sharpness=1, max_iter=300, barrier=1e-5)
    own = InteriorPoint(tolerance=1e-6)
    near = smooth.shrunk(own.minimise(smooth, start, [stage]).z, 0.999)
    end = own.minimise(smooth, near, [stage]).z
    others = [rival.minimise(smooth, begin, [stage]).z for begin in (near, smooth.shrunk(end, 0.999))]
    value, *best = (smooth.surrogate(z, 1)[0] for z in (end, *others))
    # The value is log det(Y'Y) / 2 m with its sign turned: 0.02 of it is 2 % of a standard error.
    assert value <= min(best) + 2e-2
    assert min(best) <= value + worse


def test_rows_that_bernstein_implies(problem: FourierProblem) -> None:
    """Whatever keeps the rows that are kept, keeps those left out: along any direction none of them is met first."""
    rows, marks = problem.rows, implied(problem)
    assert marks.any()
    rng = np.random.default_rng(0)
    still = problem.free(np.zeros(problem.size))
    for _ in range(200):
        ahead = rng.normal(size=still.shape) * problem.scale * rng.uniform(0.1, 1, (1, still.shape[1]))
        excess = np.where(marks, rows.excess(still + ahead * rows.room(still, ahead)[:, None]), -np.inf)
        kept = np.where(marks, -np.inf, rows.excess(still + ahead * rows.room(still, ahead)[:, None]))
        # Neither a tightened bound nor the samples see the peak of the quantity before it: 0.3 % is between them.
        assert excess.max() <= 3e-3
        assert kept.max() == pytest.approx(0, abs=1e-9)


def test_slacks_and_their_slopes(problem: FourierProblem, start: np.ndarray) -> None:
    """Slacks are linear in z; pullback and normal matrix are those of the matrix of their changes."""
    slacks = LinearSlacks(problem)
    rng = np.random.default_rng(1)
    p, w = rng.normal(size=problem.size), rng.uniform(size=slacks.size)
    np.testing.assert_allclose(
        slacks.values(start + p) - slacks.values(start), slacks.change(p), atol=1e-12 * np.abs(p).max() * 100
    )
    changes = np.column_stack([slacks.change(unit) for unit in np.eye(problem.size)])
    np.testing.assert_allclose(slacks.pullback(w), changes.T @ w, atol=1e-9)
    matrix = np.zeros((problem.size, problem.size))
    slacks.add_normal(matrix, w)
    np.testing.assert_allclose(matrix, changes.T @ (w[:, None] * changes), atol=1e-8 * np.abs(matrix).max())
    assert slacks.values(start).min() > 0


@pytest.fixture(scope="module")
def limited() -> FourierProblem:
    """The UR10 with limits of torque and self-clearance; its design reaches both."""
    robot = load_robot("ur10")
    base = find_base_parameters(default_model(robot, friction="coulomb-viscous", velocity_scale=0.02))
    limits = usable_limits(robot.limits)
    torque = 0.5 * np.asarray(robot.limits.torque)
    robot = replace(robot, limits=replace(robot.limits, torque=torque))
    kept = LimitOptions(torque=True, torque_margin=0.1, collision=True, clearance=0.01)
    safety = choose_safety(robot, base, np.zeros(6), kept, movable=True)
    return FourierProblem(
        base=base,
        criterion=criterion("cond"),
        limits=limits,
        pointwise=safety.pointwise,
        home=safety.home,
        family=Fourier(harmonics=3),
    )


@pytest.fixture(scope="module")
def begin(limited: FourierProblem) -> np.ndarray:
    rng = np.random.default_rng(1)
    return min((limited.shrunk(rng.normal(size=limited.size), 0.95) for _ in range(20)), key=limited.cost)


@pytest.mark.slow
def test_more_iterations_are_no_worse(limited: FourierProblem, begin: np.ndarray) -> None:
    """Under curved limits a longer solution is no worse than a shorter one: nothing is lost by pulling it within."""
    values = []
    for max_iter in (10, 20, 40, 80):
        stage = Stage(sharpness=16, max_iter=max_iter, barrier=1e-4)
        z = InteriorPoint().minimise(limited, begin, [stage]).z
        assert limited.inside(z)
        values.append(limited.surrogate(z, 16)[0])
    # The barrier function falls; its logarithms, each weighted by 1e-4, may exchange a little with the criterion.
    assert np.diff(values).max() < 5e-3
    assert values[-1] < values[0]


@pytest.mark.slow
def test_no_worse_than_slsqp_under_curved_limits(limited: FourierProblem, begin: np.ndarray) -> None:
    """From near an optimum on which curved limits decide, SLSQP finds nothing nearby that is better by 2 %.

    Where it leaves that valley, it says nothing about this optimum.
    """
    stage = Stage(sharpness=16, max_iter=150, barrier=1e-4)
    own = InteriorPoint().minimise(limited, begin, [stage]).z
    assert limited.pointwise_excess(own).max() > -0.02
    starts = [limited.shrunk(own, share) for share in (0.999, 0.995, 0.99, 0.98)]
    ends = [Slsqp().minimise(limited, near, [stage]).z for near in starts]
    nearby = [z for z in ends if np.linalg.norm(z - own) < 0.1 * np.linalg.norm(own)]
    assert nearby
    # The value is log cond: 0.02 is 2 %.
    rival = min(limited.surrogate(z, 16)[0] for z in nearby)
    assert limited.surrogate(own, 16)[0] <= rival + 0.02


def test_curved_slacks_and_their_slopes(limited: FourierProblem, begin: np.ndarray) -> None:
    """Changes are derivatives of the slacks; a limit that a step passes is noticed, and then is a row."""
    slacks = CurvedSlacks(limited, begin)
    values, others = slacks.values(begin)
    assert values.min() > 0
    assert others
    slacks.linearise(begin)
    p = np.random.default_rng(2).normal(size=limited.size)
    step = 1e-6
    numeric = (slacks.values(begin + step * p)[0] - slacks.values(begin - step * p)[0]) / (2 * step)
    # Central differences lose half of the digits.
    np.testing.assert_allclose(slacks.change(p), numeric, rtol=1e-5, atol=1e-6)
    weights = np.random.default_rng(3).uniform(size=slacks.size)
    assert slacks.pullback(weights) @ p == pytest.approx(weights @ slacks.change(p))
    far, before = 1.5 * begin, slacks.size
    assert not slacks.values(far)[1]
    assert slacks.choose(far)
    assert slacks.size > before
    assert slacks.values(far)[0].min() < 0
