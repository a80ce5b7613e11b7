import numpy as np
import pytest

from estimation.uncertainty import batch_factors, fast_noise, period_noise


def test_white_noise_on_a_slow_residual_is_found():
    """The fastest part of a residual shows the level of white noise under what a model leaves slowly."""
    rng = np.random.default_rng(0)
    t = 0.004 * np.arange(20_000)
    slow = 3.0 * np.sin(2 * np.pi * 0.5 * t)[:, None] * np.ones(2)
    level = fast_noise([slow + rng.normal(size=(20_000, 2)) * [0.1, 0.4]])
    # 20,000 second differences: known to 1 %.
    np.testing.assert_allclose(level, [0.1, 0.4], rtol=0.05)


def test_what_does_not_repeat_is_the_noise_of_periods():
    """A residual that repeats each period is the model's, the rest is noise, of whatever colour."""
    rng = np.random.default_rng(1)
    t = 0.004 * np.arange(10_000)
    repeated = 2.0 * np.sin(2 * np.pi * t / 4.0)[:, None]
    noise = np.repeat(rng.normal(size=(1000, 1)), 10, axis=0)
    # 1000 independent values: known to 2 %; three of four standard deviations left after the mean are made up for.
    assert period_noise(t, repeated + 0.2 * noise, 4.0)[0] == pytest.approx(0.2, rel=0.1)
    assert period_noise(t[:1500], repeated[:1500], 4.0) is None


def test_batches_find_noise_that_is_slower_than_the_model_knows():
    """Where sums over long batches scatter more than the model says, errors grow to them; else they stay."""
    rng = np.random.default_rng(2)
    model, inverse = np.diag([1.0, 4.0]), np.eye(2)
    right = rng.normal(size=(400, 2)) * np.sqrt([1.0 / 400, 4.0 / 400])
    # 400 batches know a standard deviation to 3.5 %: beyond two of those in one of forty cases, and seeds are fixed.
    np.testing.assert_array_equal(batch_factors(right, inverse, model), [1.0, 1.0])
    assert batch_factors(right * [1.0, 3.0], inverse, model) == pytest.approx([1.0, 3.0], rel=0.1)
    np.testing.assert_array_equal(batch_factors(right[:50] * 9, inverse, model), [1.0, 1.0])
