"""Tests of logs with lost messages, gaps and other recording faults."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation import diagnose, identify
from estimation.diagnosis.base_models.prepared_logs import SHORTEST, TOLERATED, _notes, _on_clock
from estimation.gate import Finding, check_log, log_sets
from estimation.recordings import make_ready
from robots.common.errors import InputError
from robots.robot import Robot
from robots.signals import Log

FEW = ("external_contact", "friction_step", "payload_change", "spring", "stribeck", "torque_sensor_drift")


@pytest.fixture(scope="module")
def log(arm_log: Callable[..., Log]) -> Log:
    """Returns twenty seconds of the arm with torque noise."""
    return arm_log(torque_noise=0.02)


def _glitched(log: Log, rows: tuple[int, ...]) -> Log:
    """Returns the log with outliers of the second joint's torque in some rows, three times its range."""
    tau = np.array(log.tau)
    for row in rows:
        tau[row, 1] += 3.0 * np.ptp(tau[:, 1])
    return replace(log, tau=tau)


def _holed(log: Log, *holes: tuple[float, float]) -> Log:
    """Returns the log without the rows within some times."""
    t = log.t - log.t[0]
    return log.rows(np.flatnonzero(~np.any([(t > low) & (t < high) for low, high in holes], axis=0)))


def _repaired(arm: Robot, log: Log) -> tuple[list[Log], list[str]]:
    """Returns the parts of a log that a diagnosis uses, and its notes."""
    ready = make_ready(arm, log, tolerated=TOLERATED)
    return _on_clock(ready, [log]), _notes(ready, "Log")


def test_a_sound_log_is_left_alone(arm: Robot, log: Log) -> None:
    """A log without faults is returned unchanged, without notes."""
    assert _repaired(arm, log) == ([log], [])


def test_a_log_that_does_not_fit_is_examined_and_said_to(arm: Robot, log: Log, monkeypatch) -> None:
    """Large effects may look like another robot: the diagnosis takes the log, with the gate's words as a note."""
    finding = Finding(name="other_robot", severity="refuse", text="the log does not fit", action="look", value=1.0)
    gate = replace(check_log(arm, log), findings=(finding,))
    monkeypatch.setattr(log_sets, "check_log", lambda robot, log: gate)
    logs, (note,) = _repaired(arm, log)
    assert logs == [log]
    assert "the log does not fit" in note


def test_rows_that_stick_out_lie_between_their_neighbours(arm: Robot, log: Log) -> None:
    """Outliers are interpolated, all other rows do not change, and a note states the row."""
    rows = (1200, 3000)
    q = np.array(log.q)
    q[3000, 0] += 0.5 * np.ptp(q[:, 0])
    (found,), notes = _repaired(arm, replace(_glitched(log, rows), q=q))
    others = np.delete(np.arange(len(log)), rows)
    for name in ("t", "q", "tau"):
        np.testing.assert_array_equal(getattr(found, name)[others], getattr(log, name)[others])
    for row in rows:
        np.testing.assert_allclose(found.tau[row, 1], 0.5 * (log.tau[row - 1, 1] + log.tau[row + 1, 1]))
        # The other joint's torque does not change.
        assert found.tau[row, 0] == log.tau[row, 0]
    # The error of a cubic is h^4 q'''' / 24, which is below the acceleration times the squared 4 ms.
    np.testing.assert_allclose(found.q[3000], log.q[3000], atol=2e-5)
    assert any("joint 2" in note and "1201" in note for note in notes)


def test_a_log_is_cut_at_its_gaps(arm: Robot, log: Log) -> None:
    """A log is cut at gaps into named parts; parts below two seconds are dropped, and short gaps are kept."""
    logs, notes = _repaired(arm, _holed(log, (6.0, 9.0), (10.5, 11.0)))
    assert all(part.duration > SHORTEST for part in logs)
    spans = [(part.t[0] - log.t[0], part.t[-1] - log.t[0]) for part in logs]
    np.testing.assert_allclose(spans, [(0.0, 6.0), (11.0, log.duration)], atol=0.0041)
    assert "from 0 to 6 s" in logs[0].name
    assert any("gap" in note for note in notes)
    # A short loss of messages is no gap.
    assert len(_repaired(arm, _holed(log, (6.0, 6.05)))[0]) == 1


@pytest.mark.slow
def test_faults_of_a_recording_are_no_effects(arm: Robot, log: Log) -> None:
    """With outliers and a gap, the verdict is `none` and the errors are those of the log without faults.

    Without the check the outliers increase the errors. The seeds are fixed; a false alarm has a chance of 1 %.
    """
    faulty = _holed(_glitched(log, (900, 3900)), (10.0, 12.0))
    sound, checked, taken = (
        diagnose(arm, given, candidates=FEW, friction="coulomb-viscous", check=check)
        for given, check in ((log, True), (faulty, True), (faulty, False))
    )
    assert sound.verdict == checked.verdict == "none"
    assert any("outlier" in note for note in checked.notes)
    assert checked.baseline == pytest.approx(sound.baseline, rel=0.3)
    assert taken.baseline[1] > 3 * sound.baseline[1]


@pytest.mark.slow
def test_stretches_of_a_log_are_reported_as_one_log(arm: Robot, log: Log) -> None:
    """A held-out log with a gap counts as one log in two stretches."""
    half = len(log) // 2
    other = log.rows(slice(half, None))
    middle = (other.duration / 2, other.duration / 2 + 0.5)
    for unseen, reported in ((other, ""), (_holed(other, middle), ", in 2 stretches")):
        result = diagnose(arm, log.rows(slice(half)), held_out=unseen, candidates=FEW[:1], friction="coulomb-viscous")
        assert result.how_unseen == f"1 log that the fit has not seen{reported}"


@pytest.mark.parametrize("field", ["held_out", "logs"])
def test_a_log_in_other_units_is_refused(arm: Robot, log: Log, field: str) -> None:
    """Times in milliseconds are refused, for logs and held-out logs."""
    wrong = replace(log.rows(slice(500, None)), t=1000.0 * (log.t[500:] + 100.0))
    logs = {"logs": log, "held_out": None, field: wrong}
    with pytest.raises(InputError, match="milliseconds"):
        diagnose(arm, logs["logs"], held_out=logs["held_out"])


def test_what_an_effect_may_look_like_is_reported_and_not_refused(arm: Robot, log: Log) -> None:
    """A wrong sign of the torque gives a note, because an effect may cause it."""
    logs, notes = _repaired(arm, replace(log, tau=-np.asarray(log.tau)))
    assert len(logs) == 1
    assert any("sign" in note for note in notes)


def test_torques_of_another_unit_are_reported(arm: Robot, log: Log) -> None:
    """If the torques differ from the description by a factor, a note says so."""
    _, (note,) = _repaired(arm, replace(log, tau=log.tau / 30.0))
    assert "the torque columns seem to hold" in note
    assert "0.03" in note


def test_torques_of_the_motors_are_refused(arm: Robot, log: Log) -> None:
    """Motor-side torques are refused if they differ from the joint torques by the gear ratios."""
    gears = np.array([100.0, 40.0])
    with pytest.raises(InputError, match="the torque of the motor on all joints"):
        _repaired(replace(arm, gear_ratio=gears), replace(log, tau=log.tau / gears))


@pytest.mark.slow
def test_an_estimate_is_diagnosed_with_its_own_logs(arm: Robot, log: Log) -> None:
    """A diagnosis of an estimate says what one of its robot and logs says, faults of the recording included."""
    faulty = _holed(_glitched(log, (900, 3900)), (10.0, 12.0))
    estimate = identify(arm, faulty, friction="coulomb-viscous")
    options = {"candidates": FEW[:2]}
    found, alone = diagnose(estimate, **options), diagnose(arm, faulty, friction="coulomb-viscous", **options)
    assert found.to_dict() == alone.to_dict()
    with pytest.raises(InputError, match="logs beside an estimate"):
        diagnose(estimate, log)
    with pytest.raises(InputError, match="in pieces"):
        diagnose(replace(estimate, recording=None))
