"""Specification of wrapped angles in a log: unwrapped where a joint turns without end, refused elsewhere."""

from dataclasses import replace

import numpy as np
import pytest

from estimation import identify, predict
from estimation.gate import check_log
from robots.common.errors import InputError
from tests.estimation.gate.findings_of import found


@pytest.fixture(scope="module")
def spindle(arm):
    """The arm with joints that turn without end."""
    return replace(arm, limits=replace(arm.limits, lower=np.full(2, -np.inf), upper=np.full(2, np.inf)))


def wrap(log, shift):
    """Wraps the angles of a log, whose zeros are moved so that the motion crosses the ends of the turn."""
    return replace(log, q=(log.q + shift + np.pi) % (2 * np.pi) - np.pi - shift)


@pytest.mark.slow
@pytest.mark.parametrize("shift", [2.6, np.array([-2.2, 3.0])])
def test_a_continuous_joint_is_unwrapped(spindle, arm_log, shift):
    """The parameters are those of the log with unwrapped angles."""
    log = arm_log(seed=1)
    cut = wrap(log, shift)
    report = check_log(spindle, cut)
    assert report.success
    assert [finding.severity for finding in found(report, "wrapped_angle")] == ["info", "info"]
    np.testing.assert_allclose(np.diff(report.usable(cut)[0].q, axis=0), np.diff(log.q, axis=0), atol=1e-9)
    options = {"friction": "coulomb-viscous", "position": False}
    values = identify(spindle, cut, **options).model.values
    np.testing.assert_allclose(values, identify(spindle, log, **options).model.values, rtol=1e-6, atol=1e-9)


@pytest.mark.slow
def test_other_joints_are_refused_with_advice_that_helps(arm, arm_log):
    """A joint with limits is refused; the advice, to unwrap the angle, leads to the fit of the right log."""
    log = arm_log(seed=1)
    cut = wrap(log, 2.6)
    report = check_log(arm, cut)
    assert {finding.severity for finding in found(report, "wrapped_angle")} == {"refuse"}
    with pytest.raises(InputError, match=r"wraps.*numpy\.unwrap"):
        identify(arm, cut)
    q = np.unwrap(cut.q, axis=0)
    mended = replace(cut, q=q - 2 * np.pi * np.round(q.mean(axis=0) / (2 * np.pi)))
    assert check_log(arm, mended).findings == ()


@pytest.mark.slow
def test_a_prediction_refuses_what_an_identification_refuses(arm, spindle, arm_log):
    """Degrees, milliseconds and wrapped angles are refused, with and without torques; wrong torques are not."""
    log = arm_log(seed=1)
    model = identify(arm, log, friction="coulomb-viscous").model
    expected = predict(model, log).predicted
    for spoilt, word in (
        (replace(log, q=np.rad2deg(log.q)), "degrees"),
        (replace(log, t=1e3 * log.t), "milliseconds"),
        (replace(log, t=1e6 * log.t), "microseconds"),
        (wrap(log, 2.6), "wraps"),
    ):
        for one in (spoilt, replace(spoilt, tau=None)):
            with pytest.raises(InputError, match=word):
                predict(model, one)
    inverted = predict(model, replace(log, tau=-log.tau))
    np.testing.assert_array_equal(inverted.predicted, expected)
    assert {finding.severity for finding in found(inverted.gate, "torque_sign")} == {"warning"}
    static = replace(log, q=np.tile(log.q[0], (len(log), 1)), tau=None)
    assert np.isfinite(predict(model, static).predicted).all()


@pytest.mark.slow
def test_a_prediction_interpolates_outliers_and_no_gaps(arm, arm_log):
    """A single wrong position does not spoil its neighbours' torques, nor does a gap in the log."""
    log = arm_log(seed=1)
    model = identify(arm, log, friction="coulomb-viscous").model
    expected = predict(model, log).predicted
    q = np.array(log.q)
    q[700, 1] += 1.0
    found = predict(model, replace(log, q=q)).predicted
    assert np.abs(found - expected).max() < 0.02 * np.abs(expected).max()
    kept = np.delete(np.arange(len(log)), slice(2000, 2300))
    cut = predict(model, log.rows(kept))
    # The filter's ends are less accurate: a tenth of a second on either side.
    inner = np.abs(np.arange(len(kept)) - 2000) > 25
    assert np.abs(cut.predicted - expected[kept])[inner].max() < 0.02 * np.abs(expected).max()
