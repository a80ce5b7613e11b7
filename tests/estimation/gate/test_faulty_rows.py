"""What the gate says of rows that are missing, torn, repeated or coarse."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.gate import check_log
from robots.signals import Log
from tests.estimation.gate.findings_of import found, joints


def test_clipped_torques_are_told(good, spoilt):
    """Torques that pile up at a limit name the share of the rows."""
    limit = np.quantile(np.abs(good().tau), 0.95, axis=0)
    report = spoilt(tau=np.clip(good().tau, -limit, limit))
    assert joints(report, "clipped") == [1, 2, 3, 4, 5, 6]
    assert found(report, "clipped")[0].value == pytest.approx(5.0, abs=0.5)


def test_gap_cuts_the_log(er3a, good):
    """Across a gap nothing is interpolated: the usable parts end and begin at it."""
    log = good()
    keep = np.r_[0:2000, 2600 : len(log)]
    cut = Log(log.t[keep], log.q[keep], tau=log.tau[keep])
    report = check_log(er3a, cut)
    assert found(report, "gap")[0].value == pytest.approx(2.404)
    assert report.parts == ((0, 2000), (2000, len(cut)))
    first, second = report.usable(cut)
    assert (len(first), second.t[0]) == (2000, log.t[2600])


def test_spikes_are_left_out(good, spoilt):
    """Single rows that stick out are named and left out of what is usable."""
    log = good()
    q, tau = log.q.copy(), log.tau.copy()
    q[500, 1] += 0.3
    tau[[700, 900], 3] = 1e6
    report = spoilt(q=q, tau=tau)
    assert report.spikes.tolist() == [500, 700, 900]
    assert not report.refused
    (usable,) = report.usable(replace(log, q=q, tau=tau))
    assert len(usable) == len(log) - 3
    assert np.abs(usable.tau).max() < 1e3


def test_kicks_at_reversals_are_no_accidents(good, spoilt):
    """Friction that falls sharply makes a peak where its joint turns round, and the arm jerks on others: it is torque.

    A row elsewhere is an accident, and so are as many rows that have nothing to do with reversals.
    """
    log = good()
    turns = np.flatnonzero(np.diff(np.sign(np.diff(log.q[:, 1]))) != 0) + 1
    assert len(turns) > 4
    for rows, left_out in ((turns, []), (np.append(turns, 900), [900]), (turns - 40, (turns - 40).tolist())):
        tau = log.tau.copy()
        tau[np.ix_(rows, [1, 2])] += 5 * np.ptp(tau[:, [1, 2]], axis=0)
        assert spoilt(tau=tau).spikes.tolist() == left_out


def test_a_joint_that_rests_may_flicker_by_a_count(good, spoilt):
    """An encoder between two counts goes back and forth as long as it stands there: that is no garbled message."""
    q = good().q.copy()
    q[:, 3] = 0.3 + 1e-5 * (np.random.default_rng(0).random(len(q)) < 0.3)
    report = spoilt(q=q)
    assert not found(report, "spikes")
    assert not len(report.spikes)


def test_lost_torques_are_left_out(good, spoilt):
    """Exact zeros in a torque that is never zero are lost messages."""
    tau = good().tau.copy()
    rows = np.arange(100, 4000, 97)
    tau[rows, 2] = 0.0
    assert set(rows) == set(spoilt(tau=tau).spikes)


def test_repeated_rows_are_counted(good, spoilt):
    """Rows that repeat the row before while the arm moves are counted."""
    log = good()
    q, tau = log.q.copy(), log.tau.copy()
    rows = np.arange(10, len(log) - 10, 8)
    q[rows], tau[rows] = q[rows - 1], tau[rows - 1]
    (finding,) = found(spoilt(q=q, tau=tau), "repeated_rows")
    assert finding.value == pytest.approx(12.5, abs=0.2)
    assert finding.severity == "warning"


def test_rows_that_a_logger_writes_again_are_left_out(good, spoilt):
    """A logger that asks four times as often as the controller answers has three old rows to a new one."""
    log = good()
    rows = 4 * (np.arange(len(log)) // 4)
    q, tau = log.q[rows], log.tau[rows]
    report = spoilt(q=q, tau=tau)
    (finding,) = found(report, "repeated_rows")
    assert "ignored" in finding.action
    (usable,) = report.usable(replace(log, q=q, tau=tau))
    moving = slice(100, -100)
    assert (np.diff(usable.t)[moving] > 3.5 * np.diff(log.t).mean()).all()
    assert np.isin(usable.t[moving], log.t[::4]).all()


def test_a_slow_arm_with_coarse_sensors_repeats_itself(good, spoilt):
    """Rows that are equal because nothing has changed by a count of the encoder, nor of the torque, are no copies."""
    log = good()
    counts = 8.0 * np.median(np.abs(np.diff(log.q, axis=0)), axis=0)
    coarse = {"q": np.round(log.q / counts) * counts, "tau": np.round(log.tau / log.tau.std(axis=0)) * 1.0}
    report = spoilt(**coarse)
    assert found(report, "repeated_rows")
    assert not len(report.stale)
    assert report.usable(replace(log, **coarse))[0] is not None


def test_hung_column_is_told(good, spoilt):
    """A torque that holds one value while the arm moves, and jumps then, hung."""
    tau = good().tau.copy()
    tau[1000:1400, 0] = tau[1000, 0]
    report = spoilt(tau=tau)
    (finding,) = found(report, "stuck")
    assert (finding.column, finding.row) == ("tau1", 1001)
    assert report.parts == ((0, 1001), (1400, len(tau)))
    first, second = report.usable(replace(good(), tau=tau))
    assert (len(first), len(second)) == (1001, len(tau) - 1400)


def test_a_slow_joint_that_hung_is_told(good, spoilt):
    """A position that hangs while the joint creeps is told by the creep about it, however fast the joint may be."""
    q = good().q.copy()
    rows = np.arange(len(q))
    # A twentieth of the speed for 800 rows: what the hang leaves out is a step that is usual elsewhere.
    way = np.cumsum(np.where(np.abs(rows - 2500) < 400, 0.05, 1.0))
    q[:, 1] = np.interp(way, rows, q[:, 1])
    q[2450:2550, 1] = q[2450, 1]
    step = np.abs(np.diff(q[:, 1]))
    assert step[2549] < 3 * np.quantile(step, 0.99)
    (finding,) = found(spoilt(q=q), "stuck")
    assert (finding.column, finding.row) == ("q2", 2451)


def test_position_that_jumps_is_refused(good, spoilt):
    """An encoder that is set anew in the middle of a log makes it useless."""
    q = good().q.copy()
    q[2500:, 4] += 0.5
    (finding,) = found(spoilt(q=q), "jump")
    assert (finding.severity, finding.joint, finding.row) == ("refuse", 5, 2501)


def test_a_joint_that_stands_for_most_of_the_log_does_not_jump_when_it_goes(good, spoilt):
    """A fast move of a fortieth of a second to and fro is one: its steps are large one after the other."""
    log = good()
    q = log.q.copy()
    move = 0.5 * (1 - np.cos(np.linspace(0.0, np.pi, 10)))
    q[:, 3] = 0.2
    q[2000:2010, 3] += 0.1 * move
    q[2010:2500, 3] += 0.1
    q[2500:2510, 3] += 0.1 * move[::-1]
    assert not found(spoilt(q=q), "jump")
    q[2200:, 3] += 0.1
    (finding,) = found(spoilt(q=q), "jump")
    assert (finding.joint, finding.value) == (4, pytest.approx(0.1, abs=0.01))


def test_quantised_position_and_torque_are_told(good, spoilt):
    """Steps that are coarse against what they measure are stated."""
    log = good()
    report = spoilt(q=np.round(log.q, 1), tau=np.round(log.tau / 5) * 5)
    assert found(report, "quantised_position")[0].value == pytest.approx(0.1)
    assert found(report, "quantised_torque")[0].value == pytest.approx(5.0)


def test_a_column_copied_over_another_is_told(good, spoilt):
    """Two columns that are the same in every row are one that was copied; those that differ in one row are not."""
    log = good()
    tau = log.tau.copy()
    tau[:, 4] = tau[:, 1]
    report = spoilt(tau=tau)
    (finding,) = found(report, "same_column")
    assert (finding.column, finding.joint, finding.severity) == ("tau5", 5, "warning")
    assert "tau2" in finding.text
    tau[1234, 4] += 1e-6
    assert not found(spoilt(tau=tau), "same_column")
    assert not found(spoilt(tau=log.tau), "same_column")
