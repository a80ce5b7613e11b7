"""Clocks of logs: several on one clock, and times that are rounded or run backwards."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from estimation.logs.provenance import are_same_log, describe_logs
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.signals import UNKNOWN_PAUSE, Log

OWN = 1.0
"""So far [s] a log may reach beyond what is known of it in a fit, to be on the same clock."""


def on_one_clock(logs: Sequence[Log], pause: float = UNKNOWN_PAUSE) -> list[Log]:
    """Puts logs with separate clocks one after the other, in the given order.

    Effects that depend on the time between logs, such as heat, are then as uncertain as the pause.

    Args:
        logs: in the order in which they were recorded.
        pause: between the end of one and the start of the next [s].

    Returns:
        The logs, the first as it was.

    Raises:
        InputError: a pause of nothing or less.
    """
    if not pause > 0.0:
        raise InputError(f"a pause of {pause} s between logs", allowed="more than 0")
    result: list[Log] = []
    for log in logs:
        start = float(result[-1].t[-1]) + pause if result else float(log.t[0])
        result.append(replace(log, t=log.t - log.t[0] + start))
    return result


def do_not_overlap(logs: Sequence[Log]) -> bool:
    """Whether logs can be on one clock: none begins before another has ended."""
    ordered = sorted(logs, key=lambda log: float(log.t[0]))
    return all(before.t[-1] < after.t[0] for before, after in pairwise(ordered))


@dataclass(frozen=True, eq=False)
class ClockedLogs:
    """Logs on one clock.

    Attributes:
        logs: to fit to.
        held_out: unseen ones.
        dated: whether it is known when the unseen ones were recorded.
        notes: what was taken for granted.
    """

    logs: tuple[Log, ...]
    held_out: tuple[Log, ...]
    dated: bool = True
    notes: tuple[str, ...] = ()


def put_on_clock(logs: Sequence[Log], held_out: Sequence[Log]) -> ClockedLogs:
    """Puts logs on one clock if their times overlap.

    Two recordings of one robot cannot overlap in time: if they do, each has its own clock. Held-out logs that overlap
    the others count as recorded after them.

    Args:
        logs: to fit to, in the order in which they were recorded where they overlap.
        held_out: unseen ones, likewise.

    Raises:
        InputError: one log given twice.
    """
    _refuse_copies(logs, held_out)
    notes = []
    if not do_not_overlap(logs):
        logs = on_one_clock(logs)
        notes.append(_OVERLAP.format(UNKNOWN_PAUSE))
    dated = not held_out or do_not_overlap([*logs, *held_out])
    if not dated:
        latest = max(logs, key=lambda log: float(log.t[-1]))
        held_out = on_one_clock([latest, *held_out])[1:]
        notes.append(_UNDATED.format(UNKNOWN_PAUSE))
    return ClockedLogs(tuple(logs), tuple(held_out), dated, tuple(notes))


_OVERLAP = (
    "The logs overlap in time, so each one has its own clock. They are taken one after the other in the given order, "
    "{:.0f} s apart. Results on heating and drift depend on this assumption."
)
_UNDATED = (
    "The held-out logs overlap the others in time. They are taken as recorded {:.0f} s later. Time-dependent findings "
    "are kept even if the held-out logs contradict them."
)


def clock_shift_between(logs: Sequence[Mapping[str, Any]], log: Log) -> tuple[float, str]:
    """Time shift of a log relative to those of a model's fit, and a note on it.

    Two recordings of one robot cannot overlap in time: a log that does has its own clock, and counts as recorded after
    them.

    Args:
        logs: of the model's fit, as its provenance describes them; those of older files state no start.
        log: another, or one of them.
    """
    if not logs or any(known.get("start") is None for known in logs):
        return 0.0, ""
    (own,) = describe_logs([log])
    for known in logs:
        if are_same_log(own, known):
            # Some of its rows may have been left out of the fit, and it may be a part of it.
            late = float(known["start"] - log.t[0])
            within = -late > -OWN and log.t[-1] < known["start"] + known["duration"] + OWN
            return (0.0 if within else late), ""
    first, last = min(known["start"] for known in logs), max(known["start"] + known["duration"] for known in logs)
    if log.t[0] > last or log.t[-1] < first:
        return 0.0, ""
    return float(last + UNKNOWN_PAUSE - log.t[0]), _LATER.format(UNKNOWN_PAUSE)


def earlier_logs_on_clock(
    logs: Sequence[Log], motion: Log, start: float, shifts: Sequence[float]
) -> tuple[list[Log], str]:
    """Puts logs of earlier motions on the clock of a motion, and gives a note on the assumption.

    Args:
        logs: of what came before, in the order in which they were recorded where their clocks each began anew.
        motion: a log.
        start: when it counts as begun [s].
        shifts: how much later [s] than their clocks say the logs count, by what is known of them.
    """
    placed = [replace(log, t=log.t + shift) for log, shift in zip(logs, shifts, strict=True)]
    if do_not_overlap([*placed, begun := replace(motion, t=motion.t - motion.t[0] + start)]):
        late = [log for log in placed if log.t[0] > begun.t[0]]
        if late:
            raise InputError(
                "a log given as earlier motion (--before) starts after the predicted motion",
                file=late[0].metadata.get("file", late[0].name or None),
                allowed="logs that end before the motion starts, or logs that each have their own clock",
            )
        return sorted(placed, key=lambda log: float(log.t[0])), ""
    *earlier, last = on_one_clock([*logs, motion])
    shift = start - float(last.t[0])
    return [replace(log, t=log.t + shift) for log in earlier], _ANEW.format(UNKNOWN_PAUSE)


_ANEW = "each of these logs has its own clock: they are taken in the given order, {:.0f} s apart"

_LATER = (
    "The log overlaps in time with those of the model's fit, and the model changes with time. The log is taken as "
    "recorded {:.0f} s after them."
)


def _refuse_copies(logs: Sequence[Log], held_out: Sequence[Log]) -> None:
    every = [*logs, *held_out]
    for k, log in enumerate(every):
        for i, other in enumerate(every[:k]):
            if _same(log, other):
                unseen = i < len(logs) <= k
                raise InputError(
                    "the held-out log is also one of the logs for the fit" if unseen else "the log is given twice",
                    file=log.metadata.get("file", log.name or None),
                    remedy="hold out a log of another motion"
                    if unseen
                    else "give it once; otherwise it would count twice",
                    kind="given_twice",
                )


def _same(one: Log, other: Log) -> bool:
    pairs = ((one.q, other.q), (one.tau, other.tau), (one.current, other.current))
    return all(np.array_equal(a, b) if a is not None and b is not None else a is b for a, b in pairs)


def uniform_times(t: Array, parts: Sequence[slice]) -> tuple[Array, float]:
    """Gives the uniform times nearest to rounded ones: one sample period, and an offset of each part.

    Args:
        t: (N,) [s].
        parts: rows without a gap between them.

    Returns:
        Times (N,) and the sample period [s].
    """
    product = square = 0.0
    for part in parts:
        rows, times = np.arange(part.stop - part.start) - 0.5 * (part.stop - part.start - 1), t[part] - t[part].mean()
        product, square = product + float(rows @ times), square + float(rows @ rows)
    period = product / square if square > 0 else 0.0
    even = np.array(t)
    for part in parts:
        rows = np.arange(part.stop - part.start)
        rest = t[part] - period * rows
        # The middle of the range: a few rows do not show the mean of a rounding.
        even[part] = period * rows + 0.5 * (rest.min() + rest.max())
    return even, period


# Steps of a position at a row are usual if below so many times the 90 % quantile of all steps.
USUAL = 3.0


def advice_on_times(t: Array, q: Array) -> str:
    """Says what to do about times that repeat or run backwards, by what the positions do there.

    Args:
        t: (N,) [s], not increasing.
        q: positions (N, n).
    """
    steps = np.abs(np.diff(q, axis=0))
    usual = USUAL * np.quantile(steps, 0.9, axis=0)
    back = np.diff(t) < 0
    few = back.sum() <= max(3, 0.01 * len(t))
    if not back.any():
        return "log the time with more digits, or keep one row of each time"
    places = np.flatnonzero(back)
    moves_on = bool((steps[places] <= usual).all())
    order = np.argsort(t, kind="stable")
    sorted_steps = np.abs(np.diff(q[order], axis=0))
    interleaves = bool((sorted_steps.sum(axis=0) > 1.5 * steps.sum(axis=0) + 1e-12).any())
    at = places[0]
    size = float(t[at] - t[at + 1])
    if few and moves_on:
        return (
            f"the arm moves on there, so the clock was set back by {size:.3g} s or a little more: split the log at "
            "this row into two logs, and do not sort it by time"
        )
    if few or interleaves:
        return "another recording begins there: split the log at this row into two logs, and do not sort it by time"
    return "sort the rows by time and keep one of each time"
