"""What repeated and new healthy motion is worth for the threshold, and the check of its rate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimation.external_forces import estimate_forces
from estimation.external_forces.thresholds.error_models import PRIOR_SECONDS

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def banded(exact):
    """The exact model with a band, so that the parameters' errors count."""
    b = len(exact.values)
    band = {"band_covariance": (1e-4 * np.eye(b)).tolist(), "band_growth": [2.0] * 3, "band_reach": [0.02] * 3}
    return replace(exact, provenance={**exact.provenance, **band, "band95": [1.0] * 3})


def again_of(log):
    """The same motion on another day, with other noise in the torque."""
    noise = 0.02 * np.random.default_rng(5).normal(size=log.tau.shape)
    return replace(log, t=log.t + 1000.0, tau=log.tau + noise, name="again")


def test_repeated_motion_says_nothing_new(banded, pushed_log):
    """Healthy logs of one motion count as long as one of them, and do not test the rate; a motion without repeats does.

    The rate's check counts the half of a log that the other half has not shown: the whole of it, less its edges.
    """
    first, other = pushed_log(11, duration=40.0), pushed_log(12, duration=20.0)
    once, again = (
        estimate_forces(banded, other, healthy=logs).calibration for logs in ([first], [first, again_of(first)])
    )
    assert once.threshold.seconds == pytest.approx(40.0, rel=0.05)
    assert again.threshold.seconds == pytest.approx(40.0, rel=0.05)
    np.testing.assert_allclose(once.errors.inside, 4.0 * PRIOR_SECONDS / (PRIOR_SECONDS + 40.0), rtol=0.02)
    np.testing.assert_allclose(again.errors.inside, once.errors.inside, rtol=0.02)
    assert once.check is not None
    assert again.check is not None
    assert 3600 * once.check.hours == pytest.approx(40.0, rel=0.1)
    assert 3600 * again.check.hours < 4.0
    assert once.check.alarms == 0


def test_log_of_the_fit_leaves_the_whole_band_open(banded, pushed_log):
    """A healthy log that the fit has seen is no new motion."""
    healthy = pushed_log(11, duration=40.0)
    known = [{"name": healthy.name, "sha256": None, "samples": len(healthy), "start": 0.0, "duration": 39.992}]
    fitted = replace(banded, provenance={**banded.provenance, "logs": known})
    found = estimate_forces(fitted, pushed_log(12), healthy=[healthy])
    assert any("was fitted to a log of --healthy" in text for text in found.warnings)
    np.testing.assert_allclose(found.calibration.errors.inside, 4.0)


def test_short_healthy_log_serves_but_does_not_test_the_rate(exact, pushed_log):
    """A log of four seconds gives a threshold. Its halves hardly settle the observer, so that nothing confirms it."""
    found = estimate_forces(exact, pushed_log(12), healthy=[pushed_log(11, duration=4.0)])
    assert found.calibration.check is not None
    assert found.calibration.check.hours < 4.0 / 3600
    assert "not confirmed" in found.reliability
