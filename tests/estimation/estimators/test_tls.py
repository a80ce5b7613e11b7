"""Total least squares, beyond what it shares with all."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.estimators import OrdinaryLeastSquares, TotalLeastSquares
from estimation.preprocessing import LowPass, resample
from estimation.regressions.moments import Moments
from estimation.regressions.position_noise import passed_noise, smoothed_noise, white_position_noise
from estimation.regressions.preparation import Rows
from robots.common.errors import InputError
from robots.signals import Log, Motion


def noisy(problem, noise, seed):
    """Exact torque with 1 % of noise, and motion with independent noise of that covariance (3, 3) in every sample."""
    rng = np.random.default_rng(seed)
    exact = problem.data(noise=0.01, seed=seed, rows=3000, period=0.004)
    root = np.linalg.cholesky(noise)
    parts, total = [], None
    for part in exact.parts:
        m = part.motion
        error = np.einsum("ab,btj->atj", root, rng.standard_normal((3, *m.q.shape)))
        motion = Motion(t=m.t, q=m.q + error[0], dq=m.dq + error[1], ddq=m.ddq + error[2])
        parts.append(Rows(motion, part.tau, part.mask))
        moments = Moments.of(problem.base.regressor(motion.q, motion.dq, motion.ddq), part.tau, part.mask)
        total = moments if total is None else total + moments
    return replace(exact, parts=parts, moments=total)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["two joints", "with a prismatic joint"])
def test_known_noise_leaves_no_bias_of_note(problem_named, name):
    """With noise of known covariance in q, dq, ddq, the largest bias falls to a seventh at most, others to half."""
    problem = problem_named(name)
    noise = np.diag([1e-4, 3e-3, 0.3]) ** 2
    n = problem.base.model.robot.n
    ols, tls = [], []
    for seed in range(6):
        data = noisy(problem, noise, seed)
        ols.append(OrdinaryLeastSquares().solve(data.moments, 0.0)[0])
        member = TotalLeastSquares(noise=np.tile(noise, (n, 1, 1)))
        tls.append(member.refine(data, *member.solve(data.moments, 0.0)).values)
    ols, tls = np.mean(ols, axis=0) - problem.truth, np.mean(tls, axis=0) - problem.truth
    worst = np.argsort(-np.abs(ols))[:3]
    # Six runs know a mean to some 3 % of the largest bias. A sign's jump is no derivative: of Coulomb friction's bias
    # some is left.
    assert abs(tls[worst[0]]) < 0.15 * abs(ols[worst[0]])
    assert (np.abs(tls[worst]) < 0.5 * np.abs(ols[worst])).all(), (ols[worst], tls[worst])


def test_exact_columns_stay_exact(problem_named):
    """Noise in the acceleration alone leaves friction, gravity and offset columns without a share of noise."""
    problem = problem_named("one joint")
    noise = np.diag([0.0, 0.0, 0.09])[None]
    member = TotalLeastSquares(noise=noise)
    data = problem.data(noise=0.01)
    share = member.refine(data, *member.solve(data.moments, 0.0)).extras["noise_share"]
    for name, value in zip(problem.base.names, share, strict=True):
        assert (value > 0) == name.startswith(("I", "Im")), name


def test_no_noise_is_least_squares(problem_named):
    """Without recorded positions nothing is known of their noise: the estimate is that of weighted least squares."""
    data = problem_named("two joints").data(noise=0.02)
    member = TotalLeastSquares()
    values, weights = member.solve(data.moments, 0.0)
    np.testing.assert_array_equal(member.refine(data, values, weights).values, values)


def test_white_noise_is_found_in_recorded_positions():
    """The noise of a smooth motion's positions is known to 3 % from 5000 samples, and steps count as noise too."""
    t = 0.004 * np.arange(5000)
    q = np.column_stack([np.sin(t), np.cos(2 * t)])
    rng = np.random.default_rng(0)
    np.testing.assert_allclose(white_position_noise(t, q + 1e-4 * rng.standard_normal(q.shape)), 1e-4, rtol=0.05)
    step = 1e-3 / 7
    np.testing.assert_allclose(white_position_noise(t, np.round(q / step) * step), step / np.sqrt(12), rtol=0.15)
    assert (white_position_noise(t, q) < 1e-9).all()
    assert (white_position_noise(t[:3], q[:3]) == 0).all()


def test_missing_and_late_samples_are_no_noise():
    """Of a log with a tenth of its rows missing, or of jittered times, the noise found is still that of the sensor."""
    t = 0.004 * np.arange(5000)
    rng = np.random.default_rng(0)
    q = np.sin(t)[:, None] + 1e-4 * rng.standard_normal((5000, 1))
    kept = rng.random(5000) > 0.1
    np.testing.assert_allclose(white_position_noise(t[kept], q[kept]), 1e-4, rtol=0.1)
    late = t + 0.001 * rng.random(5000)
    # On a grid, interpolation averages neighbours: noise is found a little low, not by orders too high.
    assert (
        0.3e-4 < white_position_noise(late, np.sin(late)[:, None] + 1e-4 * rng.standard_normal((5000, 1)))[0] < 1.5e-4
    )


def test_what_the_smoothing_passes_is_its_response():
    """The noise left in q, dq, ddq is the integral of the filter's squared response times powers of omega."""
    period, cutoff = 0.004, 10.0
    t = period * np.arange(20_000)
    positions = resample(t, np.sin(t)[:, None])
    found = passed_noise(LowPass(cutoff), positions)
    f = np.linspace(0, 0.5 / period, 20_001)
    own = cutoff / (np.sqrt(2) - 1) ** (1 / 6)
    response = 1 / (1 + (f / own) ** 6)
    expected = [np.mean(response**2 * (2 * np.pi * f) ** (2 * k)) for k in range(3)]
    # 160,000 samples of noise of 10 Hz bandwidth: some 13,000 independent ones.
    np.testing.assert_allclose(np.diag(found), expected, rtol=0.05)
    np.testing.assert_allclose(found[0, 2], -expected[1], rtol=0.05)


def test_noise_of_a_whole_fit_is_per_joint(problem_named):
    """Each joint's positions show its own noise; without records it is zero."""
    problem = problem_named("two joints")
    data = problem.data()
    assert (smoothed_noise(data) == 0).all()
    motion = data.parts[0].motion
    t = 0.004 * np.arange(len(motion))
    rng = np.random.default_rng(0)
    q = np.column_stack([np.sin(t), np.sin(t)]) + [1e-4, 3e-4] * rng.standard_normal((len(t), 2))
    noise = smoothed_noise(replace(data, logs=[Log(t=t, q=q, tau=q)], smoother=LowPass(10.0)))
    np.testing.assert_allclose(noise[1] / noise[0], 9.0, rtol=0.3)


def test_covariances_that_are_none_are_refused():
    """A matrix with a negative eigenvalue is no covariance."""
    with pytest.raises(InputError, match="allowed: covariances"):
        TotalLeastSquares(noise=-np.eye(3)[None])
