"""Tests that a single large innovation of the noise is not named as a contact."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation import diagnose
from estimation.diagnosis.noise_models.frequency_bands import low_pass
from estimation.diagnosis.searches.acceptance import _bump, _sizes
from robots.robot import Robot
from robots.signals import Log

# Correlation of the noise between consecutive samples (two values), and its standard deviation [N m].
MEMORY, SHORT, NOISE = 0.97, 0.85, np.array([0.1, 0.05])
# Encoder resolution [rad] that leaves a band of some hertz, in which a shock covers several rows.
COARSE = 1e-4
# A push on the elbow: its time [s], duration [s] and peak [N m].
MOMENT, DURATION, PUSH = 6.0, 0.3, 0.5


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "tails", "push", "found"),
    [(3, 3.0, 0.0, []), (5, 3.0, 0.0, []), (3, None, PUSH, ["external_contact"])],
    ids=["heavy tails", "other heavy tails", "a push"],
)
def test_a_shock_is_no_push(
    arm: Robot, arm_log: Callable[..., Log], seed: int, tails: float | None, push: float, found: list[str]
) -> None:
    """The largest shock of heavy-tailed noise is not named, because others are similar; a true contact is."""
    log = arm_log()
    rng = np.random.default_rng(seed)
    shape = log.tau.shape
    innovations = rng.standard_normal(shape) if tails is None else rng.standard_t(tails, shape) / 3**0.5
    noise = lfilter([np.sqrt(1 - MEMORY**2)], [1, -MEMORY], innovations, axis=0) * NOISE
    pushed = np.sin(np.pi * np.clip((log.t - log.t[0] - MOMENT) / DURATION, 0.0, 1.0))[:, None] * [0.0, push]
    log = replace(log, q=np.round(log.q / COARSE) * COARSE, tau=log.tau + noise + pushed)
    result = diagnose(arm, log, candidates=("external_contact", "stribeck"), friction="coulomb-viscous")
    assert [finding.effect for finding in result.findings] == found


@pytest.mark.parametrize("rows", [25, 400])
def test_a_shock_is_found_where_it_is_and_as_large_as_it_is(rows: int) -> None:
    """Time and size of a shock are estimated, also in short logs and in rows with a low weight."""
    band, weights = low_pass(2.0, 10.0, 2), np.ones((rows, 1))
    problem = SimpleNamespace(rows=rows, whitening=SimpleNamespace(bands=(band,), stride=2, weights=weights))
    bump = _bump(problem, 0, 0.5)
    whole, middle = np.zeros(rows + 2 * len(bump)), len(bump) + 11
    whole[middle - len(bump) // 2 : middle + len(bump) // 2 + 1] = 7.0 * bump
    left = whole[len(bump) : len(bump) + rows, None]
    weights[11] = 0.5
    sizes = _sizes(problem, left * weights, (0,), 0.5)
    assert sizes.shape == (rows, 1)
    assert np.argmax(sizes) == 11
    assert sizes.max() == pytest.approx(7.0, rel=0.02)


@pytest.mark.slow
def test_a_shock_of_one_joint_is_a_glitch_however_unlikely(arm: Robot, arm_log: Callable[..., Log]) -> None:
    """A single innovation of eighty standard deviations on one joint is not a finding."""
    log = arm_log()
    innovations = np.random.default_rng(7).standard_normal(log.tau.shape)
    innovations[round(MOMENT / 0.004), 1] += 80.0
    noise = lfilter([np.sqrt(1 - SHORT**2)], [1, -SHORT], innovations, axis=0) * NOISE
    log = replace(log, tau=log.tau + noise)
    result = diagnose(arm, log, candidates=("external_contact", "stribeck"), friction="coulomb-viscous", check=False)
    assert result.findings == ()
