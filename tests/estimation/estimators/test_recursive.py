"""Streams: the batch estimate at any time, and what forgetting does."""

import numpy as np
import pytest

from estimation.estimators import RecursiveLeastSquares, Stream, WeightedLeastSquares
from robots.common.errors import InputError, NotIdentifiableError


def stream_of(problem, data, **options):
    weights = WeightedLeastSquares(temper=1.0).weights(data.moments, 0.0)
    return Stream(problem.base, weights, **options), weights


@pytest.mark.parametrize("chunk", [1, 7, 600])
def test_a_stream_is_the_batch_whatever_its_chunks(problem_named, chunk):
    """Sample by sample or all at once, the estimate is that of weighted least squares."""
    problem = problem_named("two joints")
    data = problem.data(noise=0.02, rows=600, parts=1)
    stream, weights = stream_of(problem, data)
    part = data.parts[0]
    for start in range(0, 600, chunk):
        stream.update(part.motion.slice(start, start + chunk), part.tau[start : start + chunk])
    np.testing.assert_allclose(stream.values, data.moments.solve(weights, 0.0), rtol=1e-8, atol=1e-10)


@pytest.mark.slow
def test_its_covariance_is_the_textbooks(problem_named):
    """With white noise, stated standard errors are the scatter of 100 runs within 25 %."""
    problem = problem_named("one joint")
    found, stated = [], []
    for seed in range(100):
        data = problem.data(noise=0.05, seed=seed, rows=150)
        stream, _ = stream_of(problem, data)
        for part in data.parts:
            stream.update(part.motion, part.tau)
        found.append(stream.values)
        stated.append(np.sqrt(np.diag(stream.covariance)))
    # A standard deviation from 100 runs is known to 7 %: six parameters within 3.5 of that.
    np.testing.assert_allclose(np.std(found, axis=0), np.mean(stated, axis=0), rtol=0.25)


def test_forgetting_follows_a_change(problem_named):
    """After friction doubles, a stream that forgets finds the new value, and one that does not finds neither."""
    problem = problem_named("one joint")
    index = problem.base.names.index("f1_1")
    changed = problem.truth.copy()
    changed[index] *= 2
    forgetful, _ = stream_of(problem, problem.data(noise=0.01), forgetting=1 - 1 / 150)
    faithful, _ = stream_of(problem, problem.data(noise=0.01))
    for values in (problem.truth, changed):
        for seed in range(3):
            motion = problem.motion(seed)
            tau = problem.base.torque(motion.q, motion.dq, motion.ddq, values)
            tau = tau + 0.01 * tau.std() * np.random.default_rng(seed).standard_normal(tau.shape)
            for stream in (forgetful, faithful):
                stream.update(motion, tau)
    # 1800 samples after the change, of which 150 count: e^-12 of the old value is left.
    assert forgetful.values[index] == pytest.approx(changed[index], rel=0.03)
    assert faithful.values[index] == pytest.approx(1.5 * problem.truth[index], rel=0.1)


def test_forgetting_weighs_by_age(problem_named):
    """Chunked or not, a sample of age k counts by the forgetting to the power k."""
    problem = problem_named("one joint")
    data = problem.data(noise=0.1, rows=200, parts=1)
    part = data.parts[0]
    stream, _ = stream_of(problem, data, forgetting=0.99)
    for start in (0, 50, 130):
        stop = {0: 50, 50: 130, 130: 200}[start]
        stream.update(part.motion.slice(start, stop), part.tau[start:stop])
    root = np.sqrt(0.99 ** np.arange(199, -1, -1))[:, None]
    Y = problem.base.regressor(part.motion.q, part.motion.dq, part.motion.ddq)[:, 0]
    expected = np.linalg.lstsq(Y * root, part.tau[:, 0] * root[:, 0], rcond=None)[0]
    np.testing.assert_allclose(stream.values, expected, rtol=1e-7, atol=1e-9)


def test_a_prior_answers_before_the_data_do(problem_named):
    """With a prior the stream has an estimate from the start; without, it says that it has none yet."""
    problem = problem_named("seven joints")
    weights = np.ones(7)
    with pytest.raises(NotIdentifiableError, match="prior"):
        _ = Stream(problem.base, weights).values
    size = problem.base.size
    stream = Stream(problem.base, weights, prior=problem.truth, prior_covariance=np.full(size, 0.1))
    np.testing.assert_allclose(stream.values, problem.truth, rtol=1e-9)
    motion = problem.motion().slice(0, 20)
    stream.update(motion, problem.base.torque(motion.q, motion.dq, motion.ddq, problem.truth))
    np.testing.assert_allclose(stream.values, problem.truth, rtol=1e-6, atol=1e-8)
    assert (np.diag(stream.covariance) >= 0).all()


def test_the_estimator_hands_its_stream_on(problem_named):
    """After a fit, the stream of the extras takes more data."""
    problem = problem_named("one joint")
    data = problem.data(noise=0.02)
    member = RecursiveLeastSquares()
    stream = member.refine(data, *member.solve(data.moments, 0.0)).extras["stream"]
    before = stream.covariance
    stream.update(data.parts[0].motion, data.parts[0].tau)
    assert (np.diag(stream.covariance) < np.diag(before)).all()


def test_what_does_not_fit_is_refused(problem_named):
    """Weights, priors, torques and masks of other shapes are refused."""
    problem = problem_named("two joints")
    motion = problem.motion(rows=20)
    for arguments in ({"weights": [1.0]}, {"weights": [1.0, -1.0]}, {"weights": [1.0, 1.0], "forgetting": 0.0}):
        with pytest.raises(InputError, match="allowed: "):
            Stream(problem.base, **arguments)
    with pytest.raises(InputError, match="allowed: "):
        Stream(problem.base, np.ones(2), prior_covariance=np.ones(3))
    stream = Stream(problem.base, np.ones(2))
    with pytest.raises(InputError, match="allowed: "):
        stream.update(motion, np.zeros((20, 3)))
    with pytest.raises(InputError, match="allowed: "):
        stream.update(motion, np.zeros((20, 2)), np.ones((3, 2)))
