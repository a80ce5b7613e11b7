"""What every local solver of design problems does, and that both arrive at the same optimum."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from oed.criteria import criterion
from oed.experiments import InteriorPoint, Ipopt, Solver, usable_limits
from oed.experiments.problems.problem import FourierProblem
from oed.experiments.solvers import Stage
from oed.experiments.solvers.slacks import LinearSlacks, implied
from robots.base_parameters import find_base_parameters
from robots.loading import load_robot
from robots.regressor import default_model

SOLVERS = (InteriorPoint(), Ipopt())


@pytest.fixture(scope="module")
def problem() -> FourierProblem:
    base = find_base_parameters(default_model(load_robot("er3a"), friction="coulomb-viscous", velocity_scale=0.02))
    return FourierProblem(base=base, criterion=criterion("cond"), limits=usable_limits(base.model.robot.limits))


@pytest.fixture(scope="module")
def start(problem: FourierProblem) -> np.ndarray:
    rng = np.random.default_rng(3)
    return min((problem.shrunk(rng.normal(size=problem.size), 0.95) for _ in range(20)), key=problem.cost)


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
        tell=lambda: next(left, None) is not None,
    )
    assert solved.iterations <= 6
    assert problem.rows.excess(problem.free(solved.z)).max() < 1e-9
    assert problem.cost(solved.z) < problem.cost(start)


def test_same_optimum(problem: FourierProblem, start: np.ndarray) -> None:
    """IPOPT, the oracle, ends at nothing better: neither from a point near the optimum nor from where ours ended.

    By its rounding it may end at another optimum that is worse.
    """
    smooth = replace(problem, criterion=criterion("d"))
    stage = Stage(sharpness=1, max_iter=300, barrier=1e-5)
    own, oracle = InteriorPoint(tolerance=1e-6), Ipopt(tolerance=1e-6)
    near = smooth.shrunk(own.minimise(smooth, start, [stage]).z, 0.999)
    end = own.minimise(smooth, near, [stage]).z
    others = [oracle.minimise(smooth, begin, [stage]).z for begin in (near, smooth.shrunk(end, 0.999))]
    value, *best = (smooth.surrogate(z, 1)[0] for z in (end, *others))
    # The value is log det(Y'Y) / 2 m with its sign turned: 0.02 of it is 2 % of a standard error.
    assert value <= min(best) + 2e-2
    assert min(best) <= value + 0.1


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
