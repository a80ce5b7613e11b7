"""Logs of many days on one clock: clocks that were set back or begin anew, dates in names, and missing days."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from estimation.comparisons.runs import date_in
from estimation.monitoring.findings import when
from robots.common.tables.times import SECONDS_PER_DAY
from robots.signals import UNKNOWN_PAUSE, Log


@dataclass(frozen=True, kw_only=True)
class Placed:
    """A log on the monitor's clock.

    Attributes:
        log: as recorded.
        shift: what its times are later by on the monitor's clock [s].
    """

    log: Log
    shift: float


def place_logs(logs: Sequence[Log], last: float | None = None) -> tuple[list[Placed], list[str]]:
    """Puts logs on one clock, in the given order, and says what was taken for granted.

    Args:
        logs: in the order in which they were recorded.
        last: end of what the monitor has seen before [s]; None for nothing.

    Returns:
        The logs with their shifts, and a line per thing that was found.
    """
    if not logs:
        return [], []
    notes: list[str] = []
    starts = np.array([float(log.t[0]) for log in logs])
    # Logs that all begin within this time [s] have clocks of their own.
    anew = len(logs) > 1 and float(np.ptp(starts)) < 1.0
    dates = [date_in([str(log.metadata.get("file", "")).replace("\\", "/").split("/")[-1], log.name]) for log in logs]
    if anew and all(date is not None for date in dates) and len(set(dates)) == len(dates):
        known = [float(date) for date in dates if date is not None]
        notes.append("Each log has its own clock. The dates in the names of the logs were used.")
        return [Placed(log=log, shift=date - float(log.t[0])) for log, date in zip(logs, known, strict=True)], notes
    if anew:
        notes.append(
            f"Each log has its own clock: the logs are taken {UNKNOWN_PAUSE:.0f} s apart, in the order "
            f"{_listed([log.name for log in logs])}. The heat at their start is uncertain."
        )
    placed: list[Placed] = []
    end, shift = last, 0.0
    for log in logs:
        first, final = float(log.t[0]), float(log.t[-1])
        if end is not None and first + shift <= end:
            back = end - (first + shift)
            shift = end + UNKNOWN_PAUSE - first
            if not anew:
                notes.append(
                    f"{log.name or 'A log'}: the clock was set back by {_duration(back)} before this log. It is taken "
                    f"{UNKNOWN_PAUSE:.0f} s after the one before; later dates are uncertain."
                )
        placed.append(Placed(log=log, shift=shift))
        end = final + shift
    return placed, notes


def missing_days(spans: Sequence[tuple[float, float]]) -> list[str]:
    """Says on which days there is no log, where there is one on most days.

    Args:
        spans: start and end of each log [s], in order.
    """
    if len(spans) < 3:
        return []
    origin = spans[0][0]
    pauses = np.array([later[0] - before[1] for before, later in pairwise(spans)])
    nights = pauses[pauses > SECONDS_PER_DAY / 4]
    if len(nights) < 2 or float(np.median(nights)) > 1.25 * SECONDS_PER_DAY:
        return []
    found = []
    for before, later in pairwise(spans):
        days = round((later[0] - before[0]) / SECONDS_PER_DAY)
        if later[0] - before[1] > 1.25 * SECONDS_PER_DAY and days >= 2:
            count = "a day" if days == 2 else f"{days - 1} days"
            found.append(
                f"No log for {count} between {when(before[1], origin)} and {when(later[0], origin)}. A change in this "
                "time is dated to the whole of it."
            )
    return found


def _listed(names: Sequence[str]) -> str:
    """Names in their order; the middle of a long list is left out."""
    listed = 12
    shown = names if len(names) <= listed else [*names[: listed - 2], "...", names[-1]]
    return ", ".join(shown)


def _duration(seconds: float) -> str:
    if seconds >= 2 * SECONDS_PER_DAY:
        return f"{seconds / SECONDS_PER_DAY:.1f} days"
    return f"{seconds / 3600:.1f} h" if seconds >= 3600 else f"{seconds:.0f} s"
