"""An extended model predicts another log with the smoothing that suits its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation import diagnose
from estimation.diagnosis.predicting import smoothed_best
from estimation.diagnosis.states import record
from estimation.prediction import predict
from robots.robot import Robot
from robots.signals import Log


def test_a_model_predicts_unseen_motion_about_as_well_as_any_smoothing_lets_it(
    arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable
) -> None:
    """Whatever it was given before: a joint's coarse encoder is noise that the other one's fine one is not."""
    log, other = (
        replace(seen, q=seen.q + np.random.default_rng(4).normal(size=seen.q.shape) * [1e-3, 1e-6])
        for seen in (arm_log(torque_noise=0.02), arm_log(torque_noise=0.02, motion_seed=5, seed=5))
    )
    model = diagnose(arm, log).model
    problem = pose_arm(record(arm, [log]))
    lowest, highest = (
        extreme(problem.recording.cutoff, *(band.cutoff for band in problem.whitening.bands)) for extreme in (min, max)
    )
    assert lowest <= model.provenance["cutoff_hz"] <= 1.001 * highest
    unseen = {
        cutoff: predict(replace(model, provenance={**model.provenance, "cutoff_hz": cutoff}), other).relative_spread
        for cutoff in (0.5 * lowest, lowest, np.sqrt(lowest * highest), highest, 3 * highest)
    }
    own = predict(model, other).relative_spread
    assert np.log(own).mean() < min(np.log(spread).mean() for spread in unseen.values()) + 0.1
    assert np.log(own).mean() < np.log(unseen[3 * highest]).mean() - 0.1
    again = smoothed_best(replace(model, provenance={**model.provenance, "cutoff_hz": 99.0}), problem, [log])
    assert again.provenance["cutoff_hz"] == pytest.approx(model.provenance["cutoff_hz"], rel=0.3)
