"""The threshold of a stated false-alarm rate."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation.external_forces.thresholds.alarm_rates import alarm_threshold
from robots.common.errors import InputError

PERIOD = 0.01


def coloured(seed, samples, memory=0.05, n=4):
    """Squared distance of n independent first-order autoregressive signals of variance 1."""
    a = np.exp(-PERIOD / memory)
    noise = np.random.default_rng(seed).normal(size=(samples, n)) * np.sqrt(1 - a * a)
    return (lfilter([1.0], [1.0, -a], noise, axis=0) ** 2).sum(axis=1)


@pytest.mark.slow
def test_rate_of_alarms_is_the_stated_one():
    """Thresholds from two minutes are passed in two hours of the same process at no more than the stated rate.

    Twelve thresholds for 60 alarms per hour. Each is the highest of several levels and that of a predictive
    distribution, so the mean rate of two hours each is to be below the stated one, and above a tenth of it. Seeds are
    fixed.
    """
    rates = []
    for seed in range(12):
        found = alarm_threshold(coloured(seed, 12_000), PERIOD, 60.0)
        series = coloured(1000 + seed, 720_000) > found.value
        places = np.flatnonzero(series)
        alarms = int(bool(len(places))) + int((np.diff(places) * PERIOD > found.separation).sum())
        rates.append(alarms / 2.0)
    assert 6.0 < np.mean(rates) < 60.0


def test_peaks_are_as_rare_as_the_process_is_slow():
    """A statistic that is constant over ten samples has a tenth of the peaks. The extremal index shows this."""
    white = np.random.default_rng(0).exponential(size=3000)
    held = np.repeat(white, 10)
    fast, slow = alarm_threshold(white, PERIOD, 1.0), alarm_threshold(held, PERIOD, 1.0)
    assert fast.extremal_index > 0.8
    assert slow.extremal_index == pytest.approx(0.1, abs=0.03)
    assert slow.peaks == pytest.approx(0.1 * (held > slow.base).sum(), rel=0.1)


def test_threshold_of_exponential_peaks_has_its_closed_form():
    """Independent exponential samples: the threshold is their quantile log(N T), or up to 1.35 times that.

    The highest of nine levels counts, and the smallest number of peaks is 20 or more: their mean scatters by a fifth.
    """
    samples = np.random.default_rng(1).exponential(size=60_000)
    found = alarm_threshold(samples, PERIOD, 6.0)
    exact = np.log(3600 / PERIOD / 6.0)
    assert exact < found.value < 1.35 * exact
    assert np.log(10.0) < found.at(0.6) - found.at(6.0) < 1.35 * np.log(10.0)


def test_median_height_resists_a_contact():
    """One peak a thousand times as high moves the robust threshold little, and the other one a lot."""
    series = coloured(3, 12_000)
    touched = series.copy()
    touched[5000:5010] = 5000.0
    clean = alarm_threshold(series, PERIOD, 1.0).value
    assert alarm_threshold(touched, PERIOD, 1.0, robust=True).value < 2 * clean
    assert alarm_threshold(touched, PERIOD, 1.0).value > 5 * clean


@pytest.mark.parametrize("rate", [0.0, -1.0, np.nan, np.inf])
def test_rate_must_be_positive(rate):
    """A rate of zero has no threshold."""
    with pytest.raises(InputError, match="false alarms per hour"):
        alarm_threshold(coloured(0, 1000), PERIOD, rate)


def test_short_log_is_refused():
    """Half a second has too few independent peaks; the message says how much is needed."""
    with pytest.raises(InputError, match=r"independent peaks.*longer healthy log"):
        alarm_threshold(coloured(0, 50), PERIOD, 1.0)
