"""Specification of what heavy tails may not be taken for: an innovation of the noise that is far out is no push."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation import diagnose
from robots.robot import Robot
from robots.signals import Log

# The noise's memory from sample to sample, and its standard deviation [N m].
MEMORY, NOISE = 0.97, np.array([0.1, 0.05])
# Encoders as coarse as this [rad] leave a band of some hertz, in which a shock is a bump of several rows.
COARSE = 1e-4
# A push of the elbow: its moment, duration [s] and peak [N m].
MOMENT, DURATION, PUSH = 6.0, 0.3, 0.5


@pytest.mark.parametrize(
    ("seed", "tails", "push", "found"),
    [(3, 3.0, 0.0, []), (5, 3.0, 0.0, []), (3, None, PUSH, ["external_contact"])],
    ids=["heavy tails", "other heavy tails", "a push"],
)
def test_a_shock_is_no_push(
    arm: Robot, arm_log: Callable[..., Log], seed: int, tails: float | None, push: float, found: list[str]
) -> None:
    """Of t with three degrees of freedom the largest explains as much as a push does; but it has others of its kind."""
    log = arm_log()
    rng = np.random.default_rng(seed)
    shape = log.tau.shape
    innovations = rng.standard_normal(shape) if tails is None else rng.standard_t(tails, shape) / 3**0.5
    noise = lfilter([np.sqrt(1 - MEMORY**2)], [1, -MEMORY], innovations, axis=0) * NOISE
    pushed = np.sin(np.pi * np.clip((log.t - log.t[0] - MOMENT) / DURATION, 0.0, 1.0))[:, None] * [0.0, push]
    log = replace(log, q=np.round(log.q / COARSE) * COARSE, tau=log.tau + noise + pushed)
    result = diagnose(arm, log, candidates=("external_contact", "stribeck"), friction="coulomb-viscous")
    assert [finding.effect for finding in result.findings] == found
