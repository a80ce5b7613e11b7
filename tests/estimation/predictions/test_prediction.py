from dataclasses import replace

import numpy as np
import pytest

from estimation import identify, predict, read_log
from estimation.identifications.choices import Candidates
from estimation.predictions.prediction import Prediction
from estimation.preprocessing import LowPass, SmoothingSpline, resample, smooth
from robots.common.errors import InputError
from robots.signals import Log, Motion


@pytest.fixture(scope="module")
def model(arm, arm_log):
    return identify(arm, arm_log()).model


@pytest.mark.slow
def test_unseen_motion_is_predicted_to_the_noise(model, arm_log):
    """On another motion the error is the torque noise, 2 % of the torque, and the parameters' small errors."""
    prediction = predict(model, arm_log(seed=1, motion_seed=1))
    # The ends, where smoothing has nothing to lean on, and slow rows add some.
    assert (prediction.nrmse < 0.03).all()
    assert (prediction.nrmse > 0.015).all()


@pytest.mark.slow
def test_a_prediction_smooths_as_the_fit_did(arm, arm_log):
    """Where a spline has smoothed the fitted positions, it smooths others; where nothing is said, a low-pass does."""
    log = arm_log(encoder_counts=3.0)
    estimate = identify(arm, log, candidates=Candidates(cutoffs=(5.0,)))
    spline = {"kind": "smoothing spline", "cutoff_hz": 5.0}
    stated = {**estimate.model.provenance, "cutoff_hz": 5.0, "smoothing": spline}
    plain = {key: value for key, value in stated.items() if key != "smoothing"}
    positions = resample(log.t, log.q)
    for provenance, smoother in ((stated, SmoothingSpline(5.0)), (plain, LowPass(5.0))):
        motion = predict(replace(estimate.model, provenance=provenance), log).motion
        np.testing.assert_array_equal(motion.ddq, smooth(positions, smoother).ddq)


def test_the_errors_are_those_of_the_arrays(model, arm_log):
    """Error RMS, NRMSE and relative spread follow from measured and predicted torque, but for rows at rest or ends."""
    log = arm_log(seed=1, motion_seed=1)
    prediction = predict(model, log)
    assert prediction.rest is not None
    assert prediction.ends is not None
    moving = np.where(prediction.rest | prediction.ends[:, None], np.nan, 1.0)
    error, torque = (log.tau - prediction.predicted) * moving, log.tau * moving
    np.testing.assert_allclose(prediction.error_rms, np.sqrt(np.nanmean(error**2, axis=0)))
    np.testing.assert_allclose(prediction.nrmse, prediction.error_rms / np.sqrt(np.nanmean(torque**2, axis=0)))
    np.testing.assert_allclose(prediction.relative_spread, np.nanstd(error, axis=0) / np.nanstd(torque, axis=0))
    assert prediction.to_dict()["at_rest"] == pytest.approx(prediction.rest.mean(axis=0))
    assert prediction.to_dict()["nrmse"] == prediction.nrmse.tolist()
    assert "rel. RMS" in prediction.summary()


def test_a_fitted_log_has_the_error_that_the_fit_states(arm, arm_log):
    """The log that a model was fitted to is predicted with the error of the fit: one definition, the same rows."""
    log = arm_log()
    estimate = identify(arm, log)
    fitted = [joint.residual_rms / joint.torque_rms for joint in estimate.joints]
    np.testing.assert_allclose(predict(estimate.model, log).nrmse, fitted, rtol=1e-9)


def test_a_model_of_another_robot_is_said_not_to_fit(model, arm_log):
    """Where the error is larger than the torque's own changes, the summary asks for the cause; else it does not."""
    log = arm_log(seed=1, motion_seed=1)
    assert "worse than a constant" not in predict(model, log).summary()
    assert "outside the band" not in predict(model, log).summary()
    shifted = predict(model, replace(log, tau=log.tau * np.array([1.0, 0.7])), check=False)
    assert (
        "most torques of joint 2 are outside the band: this log shows what the fit's logs do not" in shifted.summary()
    )
    other = predict(model, replace(log, tau=log.tau * np.array([1.0, 0.05])), check=False)
    assert "worse than a constant on joint 2: check that the log is of this robot" in other.summary()


def test_below_the_cut_off_only_what_the_model_lacks_is_left():
    """Torque a tenth larger than predicted and noisy, in uneven time: below the cut-off the tenth remains."""
    rng = np.random.default_rng(2)
    t = np.cumsum(rng.uniform(0.001, 0.009, 6000))
    slow = np.sin(2 * np.pi * 0.4 * t)[:, None]
    still = np.zeros((len(t), 1))
    measured = 1.1 * slow + rng.normal(0, 0.1, slow.shape)
    motion = Motion(t=t, q=still, dq=still, ddq=still)
    prediction = Prediction(motion=motion, predicted=slow, measured=measured, joint_names=("J1",), cutoff=3.0)
    # Of the white noise 3 Hz let through a fifteenth of its power here.
    whole = np.sqrt((0.1**2 / 2 + 0.1**2) / (1.1**2 / 2 + 0.1**2))
    assert prediction.relative_spread[0] == pytest.approx(whole, rel=0.05)
    assert prediction.band_limited_spread[0] == pytest.approx(0.1 / 1.1, rel=0.12)
    written = prediction.to_dict()
    assert written["cutoff_hz"] == 3.0
    assert written["error_std_over_torque_std_below_cutoff"] == prediction.band_limited_spread.tolist()


def test_a_log_of_positions_is_enough(model, arm_log):
    """Without torque there is a prediction and no error."""
    log = arm_log(seed=1)
    blind = predict(model, Log(t=log.t, q=log.q))
    assert blind.measured is None
    assert np.isnan(blind.error_rms).all()
    assert np.isnan(blind.nrmse).all()
    assert blind.to_dict()["nrmse"] == [None, None]
    assert "no torques to compare with" in blind.summary()
    assert np.array_equal(blind.predicted, predict(model, log).predicted)


@pytest.mark.slow
def test_currents_count_by_the_torque_constants(arm, arm_log):
    """A log of currents gives the parameters and errors of the same log in torque."""
    log = arm_log()
    electric = replace(log, tau=None, current=log.tau / np.asarray(arm.torque_constant))
    by_torque, by_current = identify(arm, log), identify(arm, electric)
    np.testing.assert_allclose(by_current.model.values, by_torque.model.values, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(predict(by_torque.model, log).error_rms, by_torque_rms(by_torque, log), rtol=1e-12)
    assert predict(by_torque.model, electric).measured == pytest.approx(log.tau)


def by_torque_rms(estimate, log):
    found = predict(estimate.model, log)
    return np.sqrt(np.average((log.tau - found.predicted) ** 2, axis=0, weights=~found.rest & ~found.ends[:, None]))


@pytest.mark.slow
def test_a_saved_model_still_knows_its_torque_constants(arm, arm_log, tmp_path):
    """A model from its file compares with a log of currents as the model itself does."""
    from estimation import load_model

    log = arm_log()
    electric = replace(log, tau=None, current=log.tau / np.asarray(arm.torque_constant))
    model = identify(arm, electric).model
    model.save(tmp_path / "model.json")
    loaded = load_model(tmp_path / "model.json")
    np.testing.assert_allclose(predict(loaded, electric).error_rms, predict(model, electric).error_rms, rtol=1e-6)


def test_currents_without_torque_constants_are_refused(arm, arm_log):
    """Currents of a robot whose torque constants nobody states are refused, naming the joint and the remedy."""
    log = arm_log()
    unknown = replace(arm, torque_constant=np.array([8.0, np.nan]))
    with pytest.raises(InputError, match="torque_constant") as caught:
        identify(unknown, Log(t=log.t, q=log.q, current=log.tau, name="run"))
    assert caught.value.joint == 2
    assert caught.value.file == "run"


def test_another_number_of_joints_is_refused(model):
    """A log of three joints is none of a two-joint model."""
    t = 0.01 * np.arange(100)
    log = Log(t=t, q=np.zeros((100, 3)), metadata={"file": "three.csv"})
    with pytest.raises(InputError, match=r"three\.csv: 3 joints; allowed: 2, as in the model of arm"):
        predict(model, log)


def test_the_file_has_the_log_s_times(model, arm_log, tmp_path):
    """Writing gives t, tau1, tau2 at the log's own times, and does not overwrite."""
    prediction = predict(model, arm_log())
    path = tmp_path / "p.csv"
    prediction.save(path)
    with pytest.raises(InputError, match="force"):
        prediction.save(path)
    frame = prediction.to_frame()
    assert list(frame.columns)[:3] == ["t", "tau1", "tau2"]
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    assert lines[0].startswith("t,tau1,tau2,tau1_lower,tau1_upper,tau1_extrapolates,")
    assert np.array_equal([float(cell) for cell in lines[5].split(",")], frame.to_numpy()[4])


def test_a_file_without_torque_is_read_for_prediction(arm_log, model, tmp_path):
    """A CSV file of t and q is enough."""
    log = arm_log()
    rows = [f"{t:.6f},{a:.9f},{b:.9f}" for t, (a, b) in zip(log.t, log.q, strict=True)]
    path = tmp_path / "motion.csv"
    path.write_text("\n".join(["t,q1,q2", *rows]))
    prediction = predict(model, read_log(path, n=2, torque=False))
    assert prediction.predicted.shape == log.q.shape
