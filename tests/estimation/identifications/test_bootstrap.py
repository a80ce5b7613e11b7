"""Standard errors by resampling, beside those of the sandwich."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation import bootstrap, identify
from estimation.identifications.bootstrap import _refits
from robots.common.errors import InputError
from robots.plants import simulate

pytestmark = pytest.mark.slow

# Of the noise: each sample remembers this share of the one before.
MEMORY = 0.95


@pytest.fixture(scope="module")
def coloured(arm_plant, fourier_motion):
    """Build a log of the arm with much coloured noise, of so many periods of 10 s."""

    def build(periods, seed=0):
        plant = arm_plant()
        log = simulate(plant, fourier_motion(plant.robot, duration=10.0 * periods, period=0.01), seed=seed)
        white = np.random.default_rng(seed).normal(size=log.tau.shape)
        noise = np.sqrt(1 - MEMORY**2) * lfilter([1.0], [1.0, -MEMORY], white, axis=0)
        return replace(log, tau=log.tau + 0.05 * log.tau.std(axis=0) * noise)

    return build


@pytest.fixture(scope="module")
def by_periods(arm, coloured):
    log = coloured(24)
    estimate = identify(arm, log)
    return log, estimate, bootstrap(estimate)


def test_periods_agree_with_the_sandwich(by_periods):
    """Under coloured noise both ways to the standard errors agree, where white-noise errors are twice too small.

    With 24 periods the scatter of refits is uncertain by 15 %: a median within 0.6 to 1.5 fails wrongly in less than
    one seed of a thousand.
    """
    _, estimate, found = by_periods
    assert (found.kind, found.blocks) == ("periods", 24)
    assert estimate.colour > 2
    assert 0.6 < found.ratio < 1.5
    assert found.errors.shape == estimate.model.values.shape
    assert "24" in found.summary()
    assert list(found.to_frame().index) == list(estimate.model.names)


def test_moving_blocks_and_logs_agree_with_the_sandwich(arm, coloured):
    """Without periods, and with many logs, the errors agree as well; 1 in 1000 seeds fails wrongly."""
    log = coloured(4)
    estimate = identify(arm, log)
    blocks = bootstrap(estimate)
    assert blocks.kind == "blocks"
    logs = [coloured(2, seed) for seed in range(10)]
    found = bootstrap(identify(arm, logs))
    assert (found.kind, found.blocks) == ("logs", 10)
    for ratio in (blocks.ratio, found.ratio):
        assert 0.5 < ratio < 1.8


def test_a_mean_has_its_textbook_error():
    """Resampled white noise gives a mean the error s / sqrt(N), to what 500 draws allow (four deviations: 13 %)."""
    values = np.random.default_rng(0).normal(size=400)
    refits = _refits(np.ones((400, 1, 1)), values[:, None], 1, 500, np.random.default_rng(1))
    assert refits.std() == pytest.approx(values.std() / 20, rel=0.13)


def test_the_same_seed_gives_the_same_errors(arm, by_periods):
    """Draws follow from the seed alone."""
    _, estimate, found = by_periods
    np.testing.assert_array_equal(bootstrap(estimate).errors, found.errors)


def test_what_cannot_be_resampled_is_refused(arm, by_periods):
    """A log that was read in pieces, and too few resamples, are refused."""
    _, estimate, _ = by_periods
    with pytest.raises(InputError, match="resamples"):
        bootstrap(estimate, resamples=1)
    with pytest.raises(InputError, match="in pieces"):
        bootstrap(replace(estimate, recording=None))
