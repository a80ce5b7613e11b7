"""Clocks of logs: set back, begun anew, dated by names, and days without a log."""

import numpy as np
import pytest

from estimation.monitoring.stored_logs.log_clock import missing_days, place_logs
from robots.common.tables.times import SECONDS_PER_DAY
from robots.signals import UNKNOWN_PAUSE, Log


def log(start, name="", length=100.0):
    t = start + np.linspace(0, length, 30)
    return Log(t, np.zeros((30, 1)), np.zeros((30, 1)), name=name)


def test_one_clock_is_left_alone():
    """Logs on one clock keep their times, without a note."""
    placed, notes = place_logs([log(0.0), log(500.0), log(SECONDS_PER_DAY)])
    assert [p.shift for p in placed] == [0.0, 0.0, 0.0]
    assert notes == []


def test_a_clock_that_was_set_back_is_named():
    """The log after it, and those behind, follow the one before after an unknown pause."""
    placed, notes = place_logs([log(0.0), log(10000.0), log(2800.0, "tuesday"), log(3500.0)])
    assert [p.shift for p in placed] == [0.0, 0.0, 10100.0 + UNKNOWN_PAUSE - 2800.0, 10100.0 + UNKNOWN_PAUSE - 2800.0]
    (note,) = notes
    assert "tuesday" in note
    assert "set back by 2.0 h" in note


def test_own_clocks_and_dates_in_names():
    """Logs that all start at zero are taken one after the other; dates in their names place them."""
    placed, notes = place_logs([log(0.0, "a"), log(0.0, "b")])
    assert placed[1].shift == pytest.approx(100.0 + UNKNOWN_PAUSE)
    assert "own clock" in notes[0]
    placed, notes = place_logs([log(0.0, "2026-03-01"), log(0.0, "2026-03-03")])
    assert placed[1].shift - placed[0].shift == pytest.approx(2 * SECONDS_PER_DAY)
    assert "dates in the names" in notes[0]


def test_a_missing_day_is_named():
    """Daily logs with one day left out give one line; daily logs without a gap give none."""
    days = [(k * SECONDS_PER_DAY, k * SECONDS_PER_DAY + 100.0) for k in (0, 1, 2, 4, 5)]
    (note,) = missing_days(days)
    assert "No log for a day between day 3" in note
    assert missing_days([(k * SECONDS_PER_DAY, k * SECONDS_PER_DAY + 100.0) for k in range(5)]) == []
