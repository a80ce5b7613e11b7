"""Logs with stops: friction holds a joint at rest with any torque, which is neither error nor knowledge."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimation import identify, predict
from estimation.gate import check_log
from robots.plants import simulate
from robots.signals import Log
from tests.estimation.identifications.stops import stop_and_go


def held_log(arm, plant, seed: int) -> tuple[Log, np.ndarray]:
    """A log in which friction holds each joint at each stop with some torque up to that of breaking away."""
    motion, stops = stop_and_go(np.random.default_rng(seed), moves=25, stop=0.6)
    log = simulate(plant, motion, seed=seed)
    most = np.asarray(arm.friction)[:, 0]
    held = np.random.default_rng(seed + 100).uniform(-most, most, (stops.max() + 1, 2))
    return replace(log, tau=log.tau + np.where(stops[:, None] >= 0, held[stops], 0.0)), stops


@pytest.fixture(scope="module")
def logs(arm, arm_plant):
    plant = arm_plant(torque_noise=0.02)
    return held_log(arm, plant, 0), held_log(arm, plant, 1)


@pytest.mark.slow
def test_friction_at_rest_is_no_error(arm, logs):
    """Fit and prediction state the noise in motion, the gate finds nothing, and the band holds what friction may do."""
    (known, _), (unseen, stops) = logs
    assert check_log(arm, known).findings == ()
    estimate = identify(arm, known)
    assert all(joint.residual_rms < 0.035 * joint.torque_rms for joint in estimate.joints)
    assert all(joint.held_out_rms < 0.04 * joint.torque_rms for joint in estimate.joints)
    found = predict(estimate.model, unseen)
    assert (found.nrmse < 0.04).all()
    assert found.rest is not None
    assert (found.rest[stops >= 0].mean(axis=0) > 0.9).all()
    error = np.abs(unseen.tau - found.predicted)
    # Without the band of rest, one half of a 95 % band of the noise would hold few of these rows.
    assert ((error <= found.band)[found.rest].mean(axis=0) > 0.95).all()
    assert (found.band_coverage > 0.9).all()
    assert "joints at rest" in found.summary()


@pytest.mark.slow
def test_a_delay_shows_in_a_log_with_stops(arm, logs):
    """Stops are no reversals at which a joint sticks: torque that is logged 12 ms late is named."""
    (known, _), _ = logs
    late = replace(known, tau=np.vstack([np.repeat(known.tau[:1], 3, axis=0), known.tau[:-3]]))
    (found,) = [finding for finding in check_log(arm, late).findings if finding.name == "delay"]
    assert found.value == pytest.approx(0.012, abs=0.001)
