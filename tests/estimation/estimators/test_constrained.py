"""Constrained least squares: bounds, signs and a known mass."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from estimation.estimators import ConstrainedLeastSquares, PhysicallyConsistent, WeightedLeastSquares
from robots.common.errors import InfeasibleError, InputError


def solved(member, data):
    return member.refine(data, *member.solve(data.moments, data.ridge))


def test_bounds_hold_and_are_named(problem_named):
    """A bound that the data press against is reached, not crossed, and named."""
    problem = problem_named("two joints")
    index = problem.base.model.names.index("f1_1")
    ceiling = 0.5 * problem.standard[index]
    solution = solved(ConstrainedLeastSquares(bounds={"f1_1": (0.0, ceiling)}), problem.data(noise=0.02))
    assert solution.extras["standard"][index] <= ceiling
    assert solution.extras["standard"][index] == pytest.approx(ceiling, rel=1e-4)
    assert "f1_1" in solution.extras["active"]


def test_it_is_the_bounded_optimum(problem_named):
    """For a pendulum, the estimate is that of scipy's bounded least squares on the same rows."""
    problem = problem_named("one joint")
    data = problem.data(noise=0.05, rows=200)
    names = problem.base.names
    bounds = {"f2_1": (0.0, 0.2), "offset_1": (0.3, 1.0)}
    # Of a pendulum every base parameter is a standard one, or a regrouping of others that stay free.
    lower = [bounds.get(name, (-np.inf, np.inf))[0] for name in names]
    upper = [bounds.get(name, (-np.inf, np.inf))[1] for name in names]
    Y = np.concatenate([problem.base.regressor(p.motion.q, p.motion.dq, p.motion.ddq)[:, 0] for p in data.parts])
    tau = np.concatenate([part.tau[:, 0] for part in data.parts])
    expected = lsq_linear(Y, tau, bounds=(lower, upper)).x
    # Conic solvers stop at 1e-8 of the cost.
    found = solved(ConstrainedLeastSquares(bounds=bounds, signs=False), data).values
    np.testing.assert_allclose(found, expected, rtol=1e-3, atol=1e-3)


@pytest.mark.slow
def test_the_total_mass_is_kept(problem_named):
    """A known total mass is kept exactly, within a range it stays inside, and neither costs torque accuracy."""
    problem = problem_named("seven joints")
    data = problem.data(noise=0.01)
    masses = [k for k, column in enumerate(problem.base.model.columns) if column.symbol == "m"]
    plain = solved(ConstrainedLeastSquares(), data).values
    for mass in (18.0, (17.0, 17.5)):
        solution = solved(ConstrainedLeastSquares(total_mass=mass), data)
        low, high = (mass, mass) if isinstance(mass, float) else mass
        assert low - 1e-4 <= solution.extras["standard"][masses].sum() <= high + 1e-4
        level = data.moments.level(solution.values) / data.moments.level(plain)
        assert (level < 1.02).all()


def test_friction_never_drives(problem_named, assemble):
    """From data whose friction has the wrong sign, friction comes out zero or braking, and masses positive."""
    problem = problem_named("two joints")
    data = problem.data(noise=0.02)
    wrong = problem.truth.copy()
    names = problem.base.names
    wrong[[names.index(name) for name in ("f1_1", "f2_2", "Im_2")]] *= -1
    parts = []
    for part in data.parts:
        motion = part.motion
        tau = part.tau + problem.base.torque(motion.q, motion.dq, motion.ddq, wrong - problem.truth)
        parts.append(type(part)(motion, tau, part.mask))
    wrongly = assemble(problem.base, parts)
    for member in (ConstrainedLeastSquares(), PhysicallyConsistent(weight=1e-4)):
        assert {"f1_1", "f2_2"} <= set(solved(member, wrongly).extras["active"])
    standard = solved(ConstrainedLeastSquares(), wrongly).extras["standard"]
    of = dict(zip(problem.base.model.names, standard, strict=True))
    assert all(of[name] >= -1e-6 for name in of if name[:2] in ("f1", "f2", "Im") or name[:2] == "m_")


def test_what_cannot_be_is_refused(problem_named):
    """Unknown parameters are refused with near names; bounds against each other end as infeasible."""
    data = problem_named("two joints").data(noise=0.02)
    with pytest.raises(InputError, match="f1_1"):
        solved(ConstrainedLeastSquares(bounds={"f1_9": (0.0, 1.0)}), data)
    with pytest.raises(InfeasibleError, match="relax the bounds"):
        solved(ConstrainedLeastSquares(bounds={"m_1": (5.0, 6.0)}, total_mass=1.0), data)


@pytest.mark.slow
def test_what_is_known_exactly_takes_its_share_of_the_uncertainty(problem_named):
    """With a parameter known, stated errors are the scatter of the others over many draws, and its own is zero."""
    problem = problem_named("two joints")
    known, truth = problem.base.names.index("f1_1"), problem.standard[problem.base.model.names.index("f1_1")]
    member = ConstrainedLeastSquares(bounds={"f1_1": (truth, truth)}, signs=False)
    solutions = [solved(member, problem.data(noise=0.02, seed=seed)) for seed in range(60)]
    scatter = np.sqrt(np.mean([(solution.values - problem.truth) ** 2 for solution in solutions], axis=0))
    stated = np.sqrt(np.mean([np.diag(solution.covariance) for solution in solutions], axis=0))
    others = np.delete(np.arange(len(scatter)), known)
    # The standard deviation of 60 draws is known to 9 %.
    np.testing.assert_allclose(stated[others], scatter[others], rtol=0.25)
    assert abs(np.median(stated[others] / scatter[others]) - 1) < 0.1
    assert stated[known] < 1e-6 * truth
    # Viscous friction, which looks most like it, is known better than without.
    viscous = problem.base.names.index("f2_1")
    assert stated[viscous] < 0.8 * np.sqrt(free_covariance(problem, 0.02)[viscous, viscous])


def free_covariance(problem, noise):
    """Covariance of weighted least squares without constraints under the noise of `Problem.data`, by its formula."""
    data = problem.data(noise)
    weights = WeightedLeastSquares().solve(data.moments, data.ridge)[1]
    inverse = np.linalg.inv(np.tensordot(weights, data.moments.gram, axes=1))
    meat = 0.0
    for part in data.parts:
        motion = part.motion
        Y = problem.base.regressor(motion.q, motion.dq, motion.ddq)
        clean = problem.base.torque(motion.q, motion.dq, motion.ddq, problem.truth)
        rows = (Y * (weights * noise * np.sqrt(np.mean(clean**2, axis=0)))[None, :, None]).reshape(-1, Y.shape[2])
        meat = meat + rows.T @ rows
    return inverse @ meat @ inverse


@pytest.mark.slow
@pytest.mark.parametrize("member", [ConstrainedLeastSquares(), PhysicallyConsistent(weight=1e-5)], ids=lambda m: m.name)
def test_at_a_bound_intervals_hold_more_often_than_stated(problem_named, member):
    """Where the truth lies at bounds, intervals as wide as without them hold it no less often, at the bounds more."""
    problem = problem_named("two joints")
    standard = problem.standard.copy()
    touched = ("f2_1", "Im_2", "f1_2")
    standard[[problem.base.model.names.index(name) for name in touched]] = 0.0
    problem = replace(problem, standard=standard)
    errors = np.sqrt(np.diag(free_covariance(problem, 0.05)))
    within = []
    for seed in range(100):
        data = problem.data(noise=0.05, seed=seed)
        free, weights = member.solve(data.moments, data.ridge)
        values = np.array([free, member.refine(data, free, weights).values])
        within.append(np.abs(values - problem.truth) <= 1.96 * errors)
    free, bounded = np.mean(within, axis=0)
    # 100 draws know a share of 95 % to 2 %; on the same draws the fits differ by less.
    assert bounded.min() > 0.88, dict(zip(problem.base.names, bounded, strict=True))
    assert bounded.mean() > free.mean() - 0.005
    places = [problem.base.names.index(name) for name in touched]
    assert bounded[places].mean() > free[places].mean()
    assert bounded[places].mean() > 0.955
