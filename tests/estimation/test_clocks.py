"""Logs that each began their clock anew."""

from __future__ import annotations

import numpy as np
import pytest

from estimation import on_one_clock
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
