"""Specification of findings on rows that are missing, wrong, repeated or coarse."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.gate import check_log
from robots.signals import Log
from tests.estimation.gate.findings_of import found, joints


@pytest.mark.slow
def test_clipped_torques_are_reported(good, spoilt):
    """Torques that accumulate at a limit are reported with their share of the rows."""
    limit = np.quantile(np.abs(good().tau), 0.95, axis=0)
    report = spoilt(tau=np.clip(good().tau, -limit, limit))
    assert joints(report, "clipped") == [1, 2, 3, 4, 5, 6]
    assert found(report, "clipped")[0].value == pytest.approx(5.0, abs=0.5)


@pytest.mark.slow
def test_gap_cuts_the_log(er3a, good):
    """Nothing is interpolated across a gap: the log is split there."""
    log = good()
    keep = np.r_[0:2000, 2600 : len(log)]
    cut = Log(log.t[keep], log.q[keep], tau=log.tau[keep])
    report = check_log(er3a, cut)
    assert found(report, "gap")[0].value == pytest.approx(2.404)
    assert report.parts == ((0, 2000), (2000, len(cut)))
    first, second = report.usable(cut)
    assert (len(first), second.t[0]) == (2000, log.t[2600])


@pytest.mark.slow
def test_spikes_are_left_out(good, spoilt):
    """Outliers in single rows are reported, and left out of the usable rows."""
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


@pytest.mark.slow
def test_peaks_at_reversals_are_no_outliers(good, spoilt):
    """A sharp fall of friction makes a peak of torque at a reversal, on this joint and on others.

    A peak elsewhere is an outlier. So are as many peaks away from reversals.
    """
    log = good()
    turns = np.flatnonzero(np.diff(np.sign(np.diff(log.q[:, 1]))) != 0) + 1
    assert len(turns) > 4
    for rows, left_out in ((turns, []), (np.append(turns, 900), [900]), (turns - 40, (turns - 40).tolist())):
        tau = log.tau.copy()
        tau[np.ix_(rows, [1, 2])] += 5 * np.ptp(tau[:, [1, 2]], axis=0)
        assert spoilt(tau=tau).spikes.tolist() == left_out


def test_a_stop_for_one_row_is_no_outlier(er3a):
    """Between two moves in one direction a joint stands for a row, and its friction is nothing there; not elsewhere."""
    rng, t = np.random.default_rng(0), 0.004 * np.arange(4001)
    # Every second the speed is zero for a row.
    q = 0.15 * (t - np.sin(2 * np.pi * t) / (2 * np.pi))[:, None] * np.ones(6) - 1.0
    tau = 1.5 + q + 0.02 * rng.normal(size=q.shape)
    stops = np.arange(250, 4000, 250)
    for rows, left_out in ((stops, []), (stops - 60, (stops - 60).tolist())):
        spoilt = tau.copy()
        spoilt[rows, 1] = 0.0 + 0.02 * rng.normal(size=len(rows))
        assert check_log(er3a, Log(t, q, tau=spoilt)).spikes.tolist() == left_out


def test_a_joint_at_rest_may_flicker_by_an_encoder_step(good, spoilt):
    """An encoder at rest between two steps alternates between them: these are no outliers."""
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


def test_copies_of_a_logger_that_samples_too_fast_are_left_out(good, spoilt):
    """A logger that samples four times as fast as the controller answers writes three copies of each row."""
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


def test_equal_rows_of_a_slow_arm_with_coarse_sensors_are_no_copies(good, spoilt):
    """Rows are no copies if neither the encoder nor the torque has changed by a step."""
    log = good()
    counts = 8.0 * np.median(np.abs(np.diff(log.q, axis=0)), axis=0)
    coarse = {"q": np.round(log.q / counts) * counts, "tau": np.round(log.tau / log.tau.std(axis=0)) * 1.0}
    report = spoilt(**coarse)
    assert found(report, "repeated_rows")
    assert not len(report.stale)
    assert report.usable(replace(log, **coarse))[0] is not None


def test_a_column_that_hung_is_reported(good, spoilt):
    """A torque that is constant while the arm moves, and then jumps, hung."""
    tau = good().tau.copy()
    tau[1000:1400, 0] = tau[1000, 0]
    report = spoilt(tau=tau)
    (finding,) = found(report, "stuck")
    assert (finding.column, finding.row) == ("tau1", 1001)
    assert report.parts == ((0, 1001), (1400, len(tau)))
    first, second = report.usable(replace(good(), tau=tau))
    assert (len(first), len(second)) == (1001, len(tau) - 1400)


@pytest.mark.slow
def test_a_slow_joint_that_hung_is_reported(good, spoilt):
    """A jump of a position is judged by the steps around it: the joint may be much faster elsewhere."""
    q = good().q.copy()
    rows = np.arange(len(q))
    # A twentieth of the speed for 800 rows: the jump after the hang is a usual step elsewhere.
    path = np.cumsum(np.where(np.abs(rows - 2500) < 400, 0.05, 1.0))
    q[:, 1] = np.interp(path, rows, q[:, 1])
    q[2450:2550, 1] = q[2450, 1]
    step = np.abs(np.diff(q[:, 1]))
    assert step[2549] < 3 * np.quantile(step, 0.99)
    (finding,) = found(spoilt(q=q), "stuck")
    assert (finding.column, finding.row) == ("q2", 2451)


def test_position_that_jumps_is_refused(good, spoilt):
    """An encoder that is reset during a log makes it useless."""
    q = good().q.copy()
    q[2500:, 4] += 0.5
    (finding,) = found(spoilt(q=q), "jump")
    assert (finding.severity, finding.joint, finding.row) == ("refuse", 5, 2501)


@pytest.mark.slow
def test_a_joint_that_stands_most_of_the_time_does_not_jump_when_it_moves(good, spoilt):
    """A fast move of a fortieth of a second has several large steps in a row, a jump has one."""
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


@pytest.mark.slow
def test_coarse_positions_and_torques_are_reported(good, spoilt):
    """Steps that are coarse for what they measure are reported with their size."""
    log = good()
    report = spoilt(q=np.round(log.q, 1), tau=np.round(log.tau / 5) * 5)
    assert found(report, "quantised_position")[0].value == pytest.approx(0.1)
    assert found(report, "quantised_torque")[0].value == pytest.approx(5.0)


@pytest.mark.slow
def test_a_column_copied_over_another_is_reported(good, spoilt):
    """Two columns that are equal in every row are reported; those that differ in one row are not."""
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


@pytest.mark.slow
def test_a_log_that_nearly_always_rests_is_refused_once(er3a, good):
    """A second of motion in a minute determines nothing: that is said, and not that each joint is badly excited."""
    log, rows = good(), 15_000
    part = log.rows(slice(0, 250))
    q = np.concatenate([part.q, np.repeat(part.q[-1:], rows, axis=0)])
    noise = 0.02 * log.tau.std(axis=0) * np.random.default_rng(0).normal(size=(rows, 6))
    tau = np.concatenate([part.tau, part.tau[-1] + noise])
    report = check_log(er3a, replace(log, t=0.004 * np.arange(len(q)), q=q, tau=tau))
    (finding,) = report.of("refuse")
    assert finding.name == "short"
    assert finding.value == pytest.approx(1.0, abs=0.1)
    assert report.without_motion
