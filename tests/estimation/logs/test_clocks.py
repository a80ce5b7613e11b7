"""Logs that each began their clock anew."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from estimation import on_one_clock, read_log, write_log
from estimation.logs.clocks import UNKNOWN_PAUSE, clock_shift_between, put_on_clock
from estimation.logs.provenance import describe_logs
from robots.common.errors import InputError
from robots.signals import Log


def _log(start: float, rows: int) -> Log:
    return Log(t=start + 0.1 * np.arange(rows), q=np.zeros((rows, 1)), tau=np.ones((rows, 1)))


def test_they_follow_each_other() -> None:
    """The first keeps its times, each other starts a pause after the one before; what is in them stays."""
    first, second, third = on_one_clock([_log(5.0, 11), _log(0.0, 21), _log(0.0, 3)], pause=30.0)
    assert (first.t[0], first.t[-1]) == (5.0, pytest.approx(6.0))
    assert (second.t[0], second.t[-1]) == (pytest.approx(36.0), pytest.approx(38.0))
    assert third.t[0] == pytest.approx(68.0)
    assert third.tau is not None
    assert len(third) == 3


def test_no_pause_is_refused() -> None:
    """Two logs cannot be at the same time."""
    with pytest.raises(InputError, match="pause of 0"):
        on_one_clock([_log(0.0, 3)], pause=0.0)


def test_only_logs_that_overlap_are_moved() -> None:
    """Pauses that are known stay; held-out logs that overlap others come after the last of these, and are undated."""
    early, late, unseen = _log(0.0, 11), _log(70.0, 21), _log(0.0, 31)
    both = put_on_clock([late, early], [replace(unseen, t=unseen.t + 100.0)])
    assert both.dated
    assert not both.notes
    assert [log.t[0] for log in (*both.logs, *both.held_out)] == [70.0, 0.0, 100.0]
    both = put_on_clock([late, early], [unseen])
    assert not both.dated
    assert [log.t[0] for log in (*both.logs, *both.held_out)] == [70.0, 0.0, pytest.approx(132.0)]
    assert "held-out" in both.notes[0]
    both = put_on_clock([early, unseen], [])
    assert both.dated
    assert [log.t[0] for log in both.logs] == [0.0, pytest.approx(61.0)]
    assert "in the given order" in both.notes[0]


def test_a_copy_is_refused() -> None:
    """A log counts once, whenever it says it was; what repeats a motion alone is no copy."""
    log = replace(_log(0.0, 11), name="first")
    with pytest.raises(InputError, match="given twice"):
        put_on_clock([log, replace(log, t=log.t + 20.0)], [])
    with pytest.raises(InputError, match="also one of the logs for the fit"):
        put_on_clock([log], [log])
    assert log.tau is not None
    again = replace(log, tau=log.tau + 1.0)
    assert put_on_clock([log, again], []).notes
    with pytest.raises(InputError, match="given twice"):
        put_on_clock([log], [again, again])


def test_a_log_of_the_fit_keeps_its_place_and_another_comes_after() -> None:
    """By start and samples one of the fit is known; what overlaps none stays; older files say nothing."""
    q = np.zeros((11, 1))
    first, second = (Log(t=start + 0.1 * np.arange(11), q=q) for start in (0.0, 100.0))
    known = describe_logs([first, second])
    assert (
        clock_shift_between(known, second) == clock_shift_between(known, replace(first, t=first.t + 500.0)) == (0.0, "")
    )
    assert clock_shift_between(known, replace(first, t=first.t - 50.0)) == (0.0, "")
    late, word = clock_shift_between(known, replace(first, t=first.t + 0.3))
    assert late == pytest.approx(101.0 + UNKNOWN_PAUSE - 0.3)
    assert "recorded 60 s after" in word
    assert clock_shift_between([{**known[0], "start": None}], replace(first, t=first.t + 0.3)) == (0.0, "")
    assert clock_shift_between([], first) == (0.0, "")


def test_a_file_of_the_fit_is_put_where_the_fit_had_it(tmp_path: Path) -> None:
    """Logs that each began their clock anew were put one after the other: each file is known again."""
    logs = []
    for k in range(2):
        write_log(tmp_path / f"{k}.csv", Log(t=0.1 * np.arange(11), q=np.full((11, 1), 0.1 * k)))
        logs.append(read_log(tmp_path / f"{k}.csv", torque=False))
    known = describe_logs(on_one_clock(logs))
    assert [clock_shift_between(known, log)[0] for log in logs] == pytest.approx([0.0, 1.0 + UNKNOWN_PAUSE])
    # A part of one stays within it.
    assert clock_shift_between(known, on_one_clock(logs)[1].rows(slice(5, None)))[0] == 0.0
