"""Tests of the priors of base parameters that a log does not determine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation import diagnose, read_log
from estimation.diagnosis.base_models.baseline import base_model_prior, base_parameters, build_baseline
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.validations.extended_model import all_row_errors
from estimation.regressions.moments import Moments
from estimation.regressions.parameter_priors import GaussianPrior
from robots.loading import load_robot
from robots.robot import Robot
from robots.signals import Log


def test_the_fit_is_that_of_rows_and_pull_together() -> None:
    """The fit with a prior equals least squares with one additional row per parameter."""
    rng = np.random.default_rng(0)
    Y, tau, target = rng.standard_normal((40, 3)), rng.standard_normal(40), np.array([1.0, -2.0])
    weights = np.array([2.0, 5.0])
    rows = np.vstack([Y, np.column_stack([np.diag(weights), np.zeros(2)])])
    expected = np.linalg.lstsq(rows, np.concatenate([tau, weights * target]), rcond=None)[0]
    moments = Moments.of(Y[:, None], tau[:, None]).pulled(GaussianPrior(np.diag(weights**2), target))
    assert moments.posterior() == pytest.approx(expected, rel=1e-9)


def test_a_direction_without_data_goes_to_the_target() -> None:
    """A parameter whose column is zero takes the prior's mean, and another one the value of the data."""
    moments = Moments.of(np.array([[[10.0, 0.0]]]), np.array([[30.0]]))
    pulled = moments.pulled(GaussianPrior(np.diag([1e-9, 1e-9]), np.array([7.0, 5.0])))
    assert pulled.posterior() == pytest.approx([3.0, 5.0], rel=1e-6)


@pytest.mark.slow
def test_a_standing_joint_does_not_make_another_motion_absurd(arm: Robot, arm_log: Callable[..., Log]) -> None:
    """After a fit to a log in which joint 2 rests, the error on a full motion is at most four times the torque RMS.

    Least squares alone explains the encoder noise by friction of more than 1e4 times the joint's torque.
    """
    log = arm_log(torque_noise=0.02)
    other = build_recording(arm, [arm_log(motion_seed=3, torque_noise=0.02)])
    q = log.q.copy()
    q[:, 1] = 0.3 + 1e-5 * np.random.default_rng(1).standard_normal(len(q))
    recording = build_recording(arm, [replace(log, q=q, dq=None, ddq=None)])
    baseline = build_baseline(base_parameters(arm, "polynomial", (0.001, 0.001)), recording)
    weights = ~recording.sign_unknown / (0.02 * recording.tau.std(axis=0))
    values = baseline.fitted(weights, recording.tau, base_model_prior(baseline, recording))
    error = other.tau - baseline.base.torque(other.q, other.dq, other.ddq, values)
    # The prior allows errors of the torque's own size, and for friction of three times that, at high speed.
    assert np.all(np.sqrt((error**2).mean(axis=0)) < 4 * np.sqrt((other.tau**2).mean(axis=0)))


@pytest.mark.slow
def test_what_a_description_lacks_is_not_taken_for_noise(arm: Robot, arm_log: Callable[..., Log]) -> None:
    """If described links are fifty times too light, the residual is still the noise.

    If the noise estimate contained the model error, the prior would count too much: the residual would be slow, slow
    noise would give the data little weight, and the prior even more.
    """
    light = replace(arm, inertia=arm.inertia / 50.0)
    log, other = arm_log(torque_noise=0.02), arm_log(motion_seed=3, torque_noise=0.02)
    result = diagnose(light, log, held_out=other)
    noise = 0.02 * np.sqrt(np.mean(log.tau**2, axis=0) / np.mean(other.tau**2, axis=0))
    assert np.all(result.baseline < 1.3 * noise)


@pytest.mark.slow
@pytest.mark.longer
def test_friction_at_low_speed_is_no_difference_of_large_parts(data: Callable) -> None:
    """A log that its authors filtered: a third of the rows of joint 2 are too slow to count.

    Parts of its friction that are alike at higher speed had 1700 N m each and left 39 % of the torque at low speed.
    """
    log = read_log(data("ur10_unisa") / "exciting.parquet")
    model = diagnose(load_robot("ur10"), log, candidates=("presliding_hysteresis",)).model
    assert all_row_errors(model)[1] < 0.08
    bent = [value for column, value in zip(model.parameters, model.values, strict=True) if column.symbol == "f3"]
    assert np.abs(bent).max() < 200.0
