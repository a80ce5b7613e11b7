"""Tests of thinned logs: signals that change between samples are filtered like the torque."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation import diagnose
from estimation.diagnosis.base_models.baseline import base_parameters, build_baseline
from estimation.diagnosis.base_models.payload_and_gravity import build_situation
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.recordings import log_reading
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.recordings.recording import Recording, cut_recording, join_recordings
from estimation.diagnosis.recordings.thinning import REACH, decimate, decimate_recording, low_pass_rows
from robots.robot import Robot
from robots.signals import Log
from robots.terms.effects import EFFECTS


@pytest.fixture
def thin_log(arm: Robot, arm_log: Callable[..., Log], monkeypatch: pytest.MonkeyPatch) -> Recording:
    """Returns a recording of the arm with every second row."""
    log = arm_log(torque_noise=0.02)
    monkeypatch.setattr(log_reading, "MOST_ROWS", int(0.6 * len(log.t)))
    return build_recording(arm, [log])


@pytest.mark.parametrize("stride", [2, 3, 4, 8])
def test_what_bands_let_through_passes_and_nothing_falls_onto_it(stride: int) -> None:
    """Sines up to a fifth of the new rate pass to 2 %, and their aliases are damped to a hundredth."""
    rows = np.arange(400 * stride)
    inner = slice(20 * stride, -20 * stride)
    for f in np.linspace(0.01, 0.2, 20):
        slow, fast = np.sin(2 * np.pi * f / stride * rows), np.sin(2 * np.pi * (1 - f) / stride * rows)
        assert np.abs(low_pass_rows(slow, stride) - slow)[inner].max() < 0.02
        assert np.abs(low_pass_rows(fast, stride))[inner].max() < 0.01


def test_each_log_is_thinned_by_itself_and_straight_lines_stay_what_they_are() -> None:
    """Each log is thinned separately, straight lines are exact to its ends, and an impulse has a bounded reach."""
    rows = np.arange(41.0)
    both = np.concatenate([3.0 + rows[:20], 100.0 - rows[20:]])[:, None] * np.ones((1, 2))
    np.testing.assert_allclose(decimate(both, (0, 20), 2), np.concatenate([both[:20:2], both[20::2]]))
    kick = np.zeros((81, 1, 1))
    kick[40] = 1.0
    seen = np.flatnonzero(decimate(kick, (0,), 2)[:, 0, 0])
    assert seen.min() >= 20 - REACH
    assert seen.max() <= 20 + REACH
    assert len(decimate(np.ones((1, 2)), (0,), 4)) == 1


def test_rows_are_those_of_the_finer_recording(thin_log: Recording) -> None:
    """The motion is that of every second row; a row's sign is unknown if that of a neighbouring row is."""
    finer = thin_log.full_rate
    assert finer is not None
    assert thin_log.stride == 2
    for name in ("t", "q", "dq", "ddq"):
        np.testing.assert_array_equal(getattr(thin_log, name), getattr(finer, name)[::2])
    assert np.all(thin_log.sign_unknown | ~finer.sign_unknown[::2])
    assert not np.any(
        thin_log.sign_known_from_velocity & finer.sign_unknown[::2] & ~finer.sign_known_from_velocity[::2]
    )


def test_parts_of_a_thinned_log_keep_all_their_samples(thin_log: Recording) -> None:
    """Cutting and joining a thinned recording keeps its samples at full rate."""
    first, second = cut_recording(thin_log, slice(3, 1000)), cut_recording(thin_log, slice(1000, 1800))
    for part in (first, second):
        assert part.full_rate is not None
        np.testing.assert_array_equal(part.t, part.full_rate.t[::2])
    whole = join_recordings([first, second])
    assert whole.full_rate is not None
    assert whole.stride == 2
    assert len(whole.full_rate.starts) == 2
    np.testing.assert_array_equal(whole.full_rate.t[whole.full_rate.starts[1] :][::2], second.t)


def test_signs_and_what_turns_round_are_low_passed_as_the_torque_is(arm: Robot, thin_log: Recording) -> None:
    """Friction, signs and fast effects are evaluated at full rate, filtered and thinned."""
    finer = thin_log.full_rate
    assert finer is not None
    base = base_parameters(arm, "coulomb-viscous", (0.001, 0.001))
    values = np.full(base.size, 0.7)
    now = build_situation(thin_log, base.model, values, base.independent)
    whole = build_situation(finer, base.model, values, base.independent)
    np.testing.assert_allclose(now.friction, low_pass_rows(whole.friction, 2)[::2], atol=1e-12)
    np.testing.assert_allclose(now.sign, low_pass_rows(np.tanh(finer.dq / 0.001), 2)[::2], atol=1e-12)
    offset = whole.torque - whole.rigid - whole.friction
    np.testing.assert_allclose(now.torque - now.rigid - now.friction, offset[::2])
    assert now.sampled == pytest.approx(0.5 * now.period)
    for name, shape in (("presliding_hysteresis", (3e-4,)), ("stribeck", (0.05, 1.0)), ("current_lag", (0.008,))):
        hypothesis = Hypothesis(EFFECTS[name], 2)
        ((own,), (all_rows,)) = (hypothesis.columns(state, shape)[1] for state in (now, whole))
        np.testing.assert_allclose(own, low_pass_rows(all_rows, 2)[::2], atol=1e-12)


def test_torque_of_other_effects_is_known_at_all_samples(arm: Robot, thin_log: Recording) -> None:
    """A delay also acts on the torque of other effects in thinned logs."""
    base = base_parameters(arm, "coulomb-viscous", (0.001, 0.001))
    now = build_situation(thin_log, base.model, np.full(base.size, 0.7), base.independent)
    slow = 5.0 * np.sin(2.0 * thin_log.t)[:, None] * np.ones((1, arm.n))
    lag = Hypothesis(EFFECTS["current_lag"], 1)
    plain, late = (lag.columns(state, (0.001,))[1][0][:, 0] for state in (now, now.beside(slow)))
    inner = slice(20, -20)
    np.testing.assert_allclose((late - plain)[inner], -10.0 * np.cos(2.0 * thin_log.t)[inner], atol=0.05)
    assert now.beside(None).beyond is None
    np.testing.assert_array_equal(now.beside(np.array([1.0, -2.0])).whole, now.torque + np.array([1.0, -2.0]))


def test_rows_at_reversals_fit_where_signs_are_those_of_all_samples(arm: Robot, thin_log: Recording) -> None:
    """With signs at full rate the residual of sharp friction is less than a tenth of that with thinned signs."""
    finer = thin_log.full_rate
    assert finer is not None
    model = base_parameters(arm, "coulomb-viscous", (0.001, 0.001)).model
    exact = decimate_recording(replace(finer, tau=build_situation(finer, model, model.nominal).torque), 2)
    fine = exact.with_trusted(np.ones(arm.n, dtype=bool))
    assert fine.counted_rows.any()
    left = []
    for recording in (fine, replace(fine, full_rate=None)):
        baseline = build_baseline(base_parameters(arm, "coulomb-viscous", (0.001, 0.001)), recording)
        counts = ~recording.sign_unknown
        rows, tau = baseline.regressor[counts], recording.tau[counts]
        left.append(float(np.std(tau - rows @ np.linalg.lstsq(rows, tau, rcond=None)[0])))
    assert left[1] > 10.0 * left[0]


@pytest.mark.slow
def test_presliding_of_a_thinned_log_is_found(
    arm: Robot, arm_log: Callable[..., Log], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Presliding over 0.1 mrad is found in a thinned log."""
    log = arm_log(torque_noise=0.02)
    monkeypatch.setattr(log_reading, "MOST_ROWS", int(0.6 * len(log.t)))
    model = base_parameters(arm, "coulomb-viscous", (0.001, 0.001)).model
    whole = build_recording(arm, [log]).full_rate
    assert whole is not None
    state = build_situation(whole, model, np.array(model.nominal))
    torque = 6.0 * EFFECTS["presliding_hysteresis"].columns(state, 2, (1e-4,))[:, :, 0]
    first = int(np.argmin(np.abs(log.t - whole.t[0])))
    tau = log.tau.copy()
    tau[first : first + len(whole)] += torque
    found = diagnose(arm, [replace(log, tau=tau)], candidates=("presliding_hysteresis", "stribeck"))
    assert [(f.effect, f.joint) for f in found.findings] == [("presliding_hysteresis", 2)]


@pytest.mark.slow
def test_torque_that_is_cut_off_in_a_thinned_log_is_found(
    arm: Robot, arm_log: Callable[..., Log], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Clipping is found in a thinned log, with its limit."""
    log = arm_log(torque_noise=0.02)
    monkeypatch.setattr(log_reading, "MOST_ROWS", int(0.6 * len(log.t)))
    most = float(np.quantile(np.abs(log.tau[:, 0]), 0.95))
    tau = log.tau.copy()
    np.clip(tau[:, 0], -most, most, out=tau[:, 0])
    similar = ("current_clipping", "torque_constant_saturation", "current_lag", "friction_step")
    (finding,) = diagnose(arm, [replace(log, tau=tau)], candidates=similar).findings
    assert (finding.effect, finding.joint) == ("current_clipping", 1)
    assert next(p.value for p in finding.parameters if p.unit == "N m") == pytest.approx(most, rel=0.02)
