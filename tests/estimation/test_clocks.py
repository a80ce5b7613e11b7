"""Logs that each began their clock anew."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimation import on_one_clock
from estimation.clocks import clocked
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
    both = clocked([late, early], [replace(unseen, t=unseen.t + 100.0)])
    assert both.dated
    assert not both.notes
    assert [log.t[0] for log in (*both.logs, *both.held_out)] == [70.0, 0.0, 100.0]
    both = clocked([late, early], [unseen])
    assert not both.dated
    assert [log.t[0] for log in (*both.logs, *both.held_out)] == [70.0, 0.0, pytest.approx(132.0)]
    assert "held-out" in both.notes[0]
    both = clocked([early, unseen], [])
    assert both.dated
    assert [log.t[0] for log in both.logs] == [0.0, pytest.approx(61.0)]
    assert "in the order given" in both.notes[0]


def test_a_copy_is_refused() -> None:
    """A log counts once, whenever it says it was; what repeats a motion alone is no copy."""
    log = replace(_log(0.0, 11), name="first")
    with pytest.raises(InputError, match="given twice"):
        clocked([log, replace(log, t=log.t + 20.0)], [])
    with pytest.raises(InputError, match="fitted to"):
        clocked([log], [log])
    assert log.tau is not None
    again = replace(log, tau=log.tau + 1.0)
    assert clocked([log, again], []).notes
    with pytest.raises(InputError, match="given twice"):
        clocked([log], [again, again])
