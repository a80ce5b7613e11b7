"""Specification of what is done about rows whose times are those of the logger, not of the measurement."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimation.gate.checks.stalls import check_stalls

STALLS = ((500, 7), (900, 11), (2100, 3), (3000, 10))
RUSHED = 2e-4  # s between rows that were waiting


def written_late(log, stalls=STALLS):
    """Times of a logger that stalled for some rows each: what waited is written at once when it goes on."""
    t = log.t.copy()
    for first, count in stalls:
        written = log.t[first + count] - 1e-3
        t[first : first + count] = np.maximum(t[first : first + count], written + RUSHED * (np.arange(count) - count))
    assert (np.diff(t) > 0).all()
    return t


def test_rows_that_waited_are_put_back(good):
    """The log has its own times again, to a rounding, and says what was done."""
    log = good()
    late = written_late(log)
    result = check_stalls(replace(log, t=late))
    (finding,) = result.findings
    assert (finding.name, finding.severity) == ("late_rows", "warning")
    assert "stopped 4 times" in finding.text
    assert not len(result.lost)
    np.testing.assert_allclose(result.t, log.t, atol=1e-9)


def test_rows_of_a_rush_in_which_some_were_lost_are_left_out(good):
    """Where rows are missing nobody knows when the others were measured."""
    log = good()
    late = written_late(log)
    kept = np.setdiff1d(np.arange(len(log)), [501, 502, 904, 905, 906])
    result = check_stalls(replace(log.rows(kept), t=late[kept]))
    (finding,) = result.findings
    assert "ignored because others are missing" in finding.action
    assert set(kept[result.lost]) == {500, 503, 504, 505, 506} | set(range(900, 911)) - {904, 905, 906}


def test_a_logger_that_measures_anew_is_believed(good):
    """Positions that are right at the times that are told stay there, however uneven those are."""
    log = good()
    t = written_late(log)
    q = np.column_stack([np.interp(t, log.t, column) for column in log.q.T])
    result = check_stalls(replace(log, t=t, q=q))
    assert not result.findings
    assert (result.t == t).all()


def test_a_hole_is_none(good):
    """Rows that are missing shift nothing; even times stay as they are."""
    log = good()
    for some in (log, log.rows(np.setdiff1d(np.arange(len(log)), np.arange(700, 712)))):
        result = check_stalls(some)
        assert not result.findings
        assert result.t is some.t


@pytest.mark.parametrize("start", [0.0, 1.7e9])
def test_rounded_times_are_put_on_their_line(good, start):
    """Rows 4 ms apart whose times are told in 3 ms are 4 ms apart."""
    log = good()
    step = float(np.diff(log.t).mean())
    coarse = 0.75 * step
    rounded = np.round(log.t / coarse) * coarse
    result = check_stalls(replace(log, t=start + rounded))
    (finding,) = result.findings
    assert finding.name == "rounded_times"
    np.testing.assert_allclose(np.diff(result.t), step, rtol=1e-3)
    np.testing.assert_allclose(result.t - start, log.t, atol=0.05 * step)


def test_what_is_fitted_has_the_mended_times(good, spoilt):
    """`usable` hands on the times as mended, without the rows of no time."""
    log = good()
    late = written_late(log)
    report = spoilt(t=late)
    (usable,) = report.usable(replace(log, t=late))
    np.testing.assert_allclose(usable.t, log.t, atol=1e-9)
