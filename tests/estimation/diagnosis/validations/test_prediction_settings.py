"""Tests of an extended model's settings for prediction: cut-off, error band, and sharpness of the sign."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation import diagnose
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.validations.extended_model import with_band, with_best_cutoff, with_best_sign_sharpness
from estimation.diagnosis.validations.gain_intervals import HeldOutErrors
from estimation.models.extension import Extension
from estimation.models.model import Model
from estimation.predictions.prediction import predict
from robots.robot import Robot
from robots.signals import Log
from robots.terms import FrictionTerm

FEW = ("friction_step", "stribeck")  # settings are those of the base model: none of the logs has an effect


@pytest.fixture(scope="module")
def quiet(arm: Robot, arm_log: Callable[..., Log]) -> Model:
    """Returns the model of a log with little noise."""
    return diagnose(arm, arm_log(torque_noise=0.02), candidates=FEW).model


@pytest.fixture(scope="module")
def noisy(arm: Robot, arm_log: Callable[..., Log]) -> Model:
    """Returns the model of a log with more noise."""
    return diagnose(arm, arm_log(torque_noise=0.05), candidates=FEW).model


@pytest.mark.slow
def test_a_model_predicts_unseen_motion_about_as_well_as_any_smoothing_lets_it(
    arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable
) -> None:
    """The model's cut-off predicts a held-out log nearly as well as the best of several cut-offs."""
    log, other = (
        replace(seen, q=seen.q + np.random.default_rng(4).normal(size=seen.q.shape) * [1e-3, 1e-6])
        for seen in (arm_log(torque_noise=0.02), arm_log(torque_noise=0.02, motion_seed=5, seed=5))
    )
    model = diagnose(arm, log, candidates=FEW).model
    problem = pose_arm(build_recording(arm, [log]))
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
    again = with_best_cutoff(replace(model, provenance={**model.provenance, "cutoff_hz": 99.0}), problem, [log])
    assert again.provenance["cutoff_hz"] == pytest.approx(model.provenance["cutoff_hz"], rel=0.3)


@pytest.mark.slow
@pytest.mark.parametrize("held_out", [True, False])
def test_its_band_holds_most_errors_on_other_unseen_motions(
    arm: Robot, arm_log: Callable[..., Log], noisy: Model, held_out: bool
) -> None:
    """The 95 % band contains 90 to 100 % of the errors on four other motions, with and without held-out logs.

    The noise of one motion of 20 s changes this by 3 %; that of four fixed motions, by half as much.
    """
    log, other, *more = (arm_log(torque_noise=0.05, motion_seed=k, seed=k) for k in range(6))
    model = diagnose(arm, log, held_out=other, candidates=FEW).model if held_out else noisy
    assert predict(model, more[0]).band is not None
    shares = np.mean([predict(model, one).band_coverage for one in more], axis=0)
    assert np.all(np.abs(shares - 0.95) < 0.05)
    covered = model.provenance["band95_coverage"]
    reported = np.array(model.provenance["unseen_nrmse"])
    np.testing.assert_allclose(reported, predict(model, other).nrmse, rtol=1e-9 if held_out else 0.2)
    assert np.allclose(covered, 0.95, atol=0.03) if held_out else covered == [None, None]


@pytest.mark.slow
def test_heat_of_the_logs_before_counts_in_its_errors(quiet: Model, arm_log: Callable[..., Log]) -> None:
    """The held-out error of a thermal effect counts with the heat of the logs before."""
    first, other = (arm_log(torque_noise=0.02, motion_seed=k, seed=k) for k in range(2))
    other = replace(other, t=other.t + first.t[-1] + 5.0)
    heat = Extension(
        effect="thermal_friction",
        joint=2,
        shape=(300.0, 0.0, 0.0),
        coefficients=np.array([3.0, 0.0]),
        covariance=np.zeros((5, 5)),
    )
    model = replace(quiet, extensions=(heat,))
    parts = np.ones((50, 2))
    unseen = HeldOutErrors("", np.arange(50.0), 1.0, parts, (parts, parts), parts > 0, None)
    reported = with_band(model, [first], [other], unseen).provenance["unseen_nrmse"]
    warm, cold = predict(model, other, before=[first]).nrmse, predict(model, other).nrmse
    np.testing.assert_allclose(reported, warm, rtol=1e-9)
    assert warm[1] > 1.05 * cold[1]


@pytest.mark.slow
def test_its_band_grows_as_errors_do_on_parts_left_out(noisy: Model, arm_log: Callable[..., Log]) -> None:
    """The band grows by each joint's ratio of held-out to fit error, and is at least that of the fit."""
    log, model = arm_log(torque_noise=0.05), noisy
    found = predict(model, log)
    error = np.abs(log.tau - found.predicted)
    pairs = zip(error.T, found.judged.T, strict=True)
    seen = np.array([np.quantile(column[judged], 0.95) for column, judged in pairs])
    parts = np.ones((50, 2))
    fitted = (parts, np.array([1.5, 4.0]) * parts)
    unseen = HeldOutErrors("", np.arange(50.0), 1.0, parts, (parts, 3.0 * parts), parts > 0, fitted)
    assert with_band(model, [log], [], unseen).provenance["band95"] == pytest.approx((seen * [2.0, 1.0]).tolist())
    plain = replace(unseen, fitted=None)
    assert with_band(model, [log], [], plain).provenance["band95"] == pytest.approx(seen.tolist())


@pytest.mark.slow
def test_friction_turns_round_as_sharply_as_all_rows_say(quiet: Model, arm_log: Callable[..., Log]) -> None:
    """The width of the sign is restored from rows near reversals, and improves the prediction.

    A diagnosis does not use these rows. The plant's sign is tanh(dq / 1 mrad/s), and its log has 2 % of noise.
    """
    log, other = (arm_log(torque_noise=0.02, motion_seed=k, seed=k) for k in range(2))
    model = quiet
    for v0, worse in ((5e-4, 1.0), (0.016, 1.15)):
        terms = tuple(
            replace(term, velocity_scale=v0) if isinstance(term, FrictionTerm) else term
            for term in model.torque_model.terms
        )
        wrong = replace(model, torque_model=replace(model.torque_model, terms=terms))
        again = with_best_sign_sharpness(wrong, [log])
        assert again.provenance["velocity_scales"] == pytest.approx([1e-3, 1e-3], rel=0.5)
        before, after = predict(wrong, other).nrmse, predict(again, other).nrmse
        assert np.all(after <= before)
        # Friction is most of the second joint's torque, but little of the first joint's.
        assert before[1] > worse * after[1]
    assert model.provenance["velocity_scales"] == pytest.approx([1e-3, 1e-3], rel=0.5)
