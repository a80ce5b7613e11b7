"""Specification: rows with the times of the logger instead of the measurement are corrected or left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimation.gate import Context
from estimation.gate.checks.rows import late_rows

STALLS = ((500, 7), (900, 11), (2100, 3), (3000, 10))
RUSHED = 2e-4  # s between the times of rows that waited in a queue


@pytest.fixture
def checked(er3a):
    """Gives the corrected times of a log, and the findings."""

    def check(log):
        context = Context(er3a, log)
        return context.recorded.times, late_rows(context)

    return check


def written_late(log, stalls=STALLS):
    """Times of a logger that stalled for some rows each, and then read the queue at once."""
    t = log.t.copy()
    for first, count in stalls:
        written = log.t[first + count] - 1e-3
        t[first : first + count] = np.maximum(t[first : first + count], written + RUSHED * (np.arange(count) - count))
    assert (np.diff(t) > 0).all()
    return t


def test_rows_that_waited_get_their_own_times(good, checked):
    """The log has its own times again, to a rounding, and a finding says what was done."""
    log = good()
    late = written_late(log)
    times, (finding,) = checked(replace(log, t=late))
    assert (finding.name, finding.severity) == ("late_rows", "warning")
    assert "stopped 4 times" in finding.text
    assert not len(times.lost)
    np.testing.assert_allclose(times.t, log.t, atol=1e-9)


def test_rows_of_a_queue_with_losses_are_left_out(good, checked):
    """If rows are missing, it is unknown when the others were measured."""
    log = good()
    late = written_late(log)
    kept = np.setdiff1d(np.arange(len(log)), [501, 502, 904, 905, 906])
    times, (finding,) = checked(replace(log.rows(kept), t=late[kept]))
    assert "ignored because others are missing" in finding.action
    assert set(kept[times.lost]) == {500, 503, 504, 505, 506} | set(range(900, 911)) - {904, 905, 906}


def test_a_logger_that_measures_again_has_correct_times(good, checked):
    """Times are kept if the positions fit them, however uneven they are."""
    log = good()
    t = written_late(log)
    q = np.column_stack([np.interp(t, log.t, column) for column in log.q.T])
    times, findings = checked(replace(log, t=t, q=q))
    assert not findings
    assert (times.t == t).all()


def test_a_gap_is_no_stall(good, checked):
    """Missing rows shift nothing; even times are kept."""
    log = good()
    for some in (log, log.rows(np.setdiff1d(np.arange(len(log)), np.arange(700, 712)))):
        times, findings = checked(some)
        assert not findings
        assert times.t is some.t


@pytest.mark.parametrize("start", [0.0, 1.7e9])
def test_rounded_times_become_uniform(good, checked, start):
    """Rows at 4 ms with times in multiples of 3 ms get steps of 4 ms."""
    log = good()
    step = float(np.diff(log.t).mean())
    coarse = 0.75 * step
    rounded = np.round(log.t / coarse) * coarse
    times, (finding,) = checked(replace(log, t=start + rounded))
    assert finding.name == "rounded_times"
    np.testing.assert_allclose(np.diff(times.t), step, rtol=1e-3)
    np.testing.assert_allclose(times.t - start, log.t, atol=0.05 * step)


def test_the_fit_gets_the_corrected_times(good, spoilt):
    """`usable` gives the corrected times, without the rows that have none."""
    log = good()
    late = written_late(log)
    report = spoilt(t=late)
    (usable,) = report.usable(replace(log, t=late))
    np.testing.assert_allclose(usable.t, log.t, atol=1e-9)
