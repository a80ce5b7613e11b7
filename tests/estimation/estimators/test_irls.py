"""Robust estimators against rows that no noise explains."""

import numpy as np
import pytest

from estimation.estimators import Huber, Tukey, WeightedLeastSquares
from estimation.regressions.preparation import Rows


def solved(member, data):
    return member.refine(data, *member.solve(data.moments, data.ridge))


def spoilt(problem, assemble, share, seed=0):
    """Noise of 2 %, and a share of rows with a collision's torque, all to one side."""
    rng = np.random.default_rng(seed)
    parts = []
    for part in problem.data(noise=0.02, seed=seed).parts:
        tau = part.tau.copy()
        hit = rng.random(len(tau)) < share
        tau[hit] += 3.0 * tau.std(axis=0)
        parts.append(Rows(part.motion, tau, part.mask))
    return assemble(problem.base, parts)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["two joints", "seven joints"])
def test_outliers_hardly_move_robust_estimates(problem_named, assemble, name):
    """One row in twenty off by three standard deviations moves WLS ten times as much as Huber, and Tukey hardly."""
    problem = problem_named(name)
    motion = problem.motion(seed=7)
    error = {}
    for member in (WeightedLeastSquares(), Huber(), Tukey()):
        values = solved(member, spoilt(problem, assemble, 0.05)).values
        torque = problem.base.torque(motion.q, motion.dq, motion.ddq, values - problem.truth)
        error[member.name] = float(np.sqrt(np.mean(torque**2 / problem.data().parts[0].tau.var(axis=0))))
    assert error["huber"] < 0.25 * error["wls"]
    assert error["tukey"] < 0.1 * error["wls"]


def test_tukey_leaves_outliers_out_and_huber_bounds_them(problem_named, assemble):
    """A hit row has weight zero with Tukey, and a force that no longer grows with Huber."""
    data = spoilt(problem_named("two joints"), assemble, 0.05)
    huber, tukey = solved(Huber(), data), solved(Tukey(), data)
    far = 100 * huber.extras["scale"] * np.ones((3, 2))
    assert (tukey.row_weights(far) == 0).all()
    np.testing.assert_allclose(huber.row_weights(far), 1.345 / 100)
    assert (tukey.row_weights(np.zeros((3, 2))) == 1).all()


def test_the_scale_is_the_noise_in_spite_of_outliers(problem_named, assemble):
    """The residual's scale is the noise's standard deviation within 15 %, with one row in twenty spoilt."""
    data = spoilt(problem_named("two joints"), assemble, 0.05)
    # One row in twenty, all to one side, shifts the median absolute deviation by some 7 %; 1200 rows know it to 3 %.
    exact = problem_named("two joints").data()
    noise = 0.02 * np.sqrt(np.mean(np.concatenate([p.tau for p in exact.parts]) ** 2, axis=0))
    np.testing.assert_allclose(solved(Tukey(), data).extras["scale"], noise, rtol=0.2)


@pytest.mark.slow
def test_clean_data_cost_little(problem_named):
    """Under normal noise alone, robust estimates scatter at most 12 % more than least squares."""
    problem = problem_named("one joint")
    spread, drawn = {}, [problem.data(noise=0.05, seed=seed, rows=150) for seed in range(80)]
    for member in (WeightedLeastSquares(), Huber(), Tukey()):
        found = [solved(member, data).values for data in drawn]
        spread[member.name] = np.std(found, axis=0)
    # 95 % efficiency is 2.6 % of scatter; of the ratio, 80 correlated pairs know some 3 %.
    assert (spread["huber"] < 1.12 * spread["wls"]).all()
    assert (spread["tukey"] < 1.12 * spread["wls"]).all()


@pytest.mark.slow
@pytest.mark.parametrize("member", [Huber(), Tukey()], ids=lambda member: member.name)
def test_their_standard_errors_are_honest(problem_named, assemble, member):
    """With outliers or without, stated 95 % intervals hold the truth in 88 % of 30 runs or more."""
    problem = problem_named("one joint")
    for share in (0.0, 0.05):
        inside = []
        for seed in range(30):
            solution = solved(member, spoilt(problem, assemble, share, seed))
            offset = problem.base.names.index("offset_1")
            error = np.abs(solution.values - problem.truth) / np.sqrt(np.diag(solution.covariance))
            # Outliers to one side shift an offset: that is bias, not spread.
            inside.append(np.delete(error, offset) < 1.96)
        # 150 intervals, those of a run correlated: a standard deviation of 2.5 %.
        assert 0.88 < np.mean(inside) <= 1.0, (share, np.mean(inside))
