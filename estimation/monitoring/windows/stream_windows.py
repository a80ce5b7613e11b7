"""Windows of a stream: rows are kept until a window and the margin of its smoothing are complete."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.records import Record

# A window with rests ends after so many times its length of motion at the latest.
LONGEST_WINDOW = 6.0


class StreamWindows(Record):
    """Cuts rows into windows from the start of each recording on; the cuts do not depend on the chunks.

    A window holds a stated time of motion. Rests make it longer: a robot at rest shows nothing of its friction.

    Args:
        window: length [s] of the motion.
        margin: rows before and after a window that its smoothing needs [s].
        width: number of columns of a row, the time included.
        slowest: speeds (n,) below which the joints rest [rad/s or m/s]; positions are the columns after the time.
    """

    ENTRIES = ("rows", "start", "period")

    rows: Array
    start: float | None
    period: float | None

    def __init__(self, window: float, margin: float, width: int, slowest: Array) -> None:
        self.window, self.margin, self.slowest = window, margin, slowest
        self.rows = np.zeros((0, width))
        self.start = None
        self.period = None

    @property
    def last(self) -> float | None:
        """Time of the newest row [s]; None without rows."""
        return float(self.rows[-1, 0]) if len(self.rows) else None

    def add(self, rows: Array) -> Iterator[tuple[Array, float, float, bool]]:
        """Takes rows (N, width), the time first, and gives each complete window.

        Yields:
            Rows with margins, start and end of the window [s], and whether the recording ends with it.

        Raises:
            InputError: times that do not increase.
        """
        if len(rows) == 0:
            return
        t = np.concatenate([self.rows[-1:, 0], rows[:, 0]])
        steps = np.diff(t)
        if (steps <= 0).any():
            row = int(np.argmax(steps <= 0)) + (0 if len(self.rows) else 1)
            raise InputError(
                f"time does not increase: {t[row]:.6g} s is followed by {t[row + 1]:.6g} s",
                column="t",
                remedy="call end() before a recording whose clock begins anew",
            )
        if self.period is None and len(steps) >= 1:
            self.period = float(np.median(steps))
        # A step of twenty median steps, and of half a second, is a pause.
        longest = max(20.0 * (self.period or 0.0), 0.5)
        begin = 0
        offset = 1 if len(self.rows) else 0
        for cut in np.flatnonzero(steps > longest).tolist():
            stop = cut + 1 - offset
            yield from self._grow(rows[begin:stop])
            yield from self.end()
            begin = stop
        yield from self._grow(rows[begin:])

    def end(self) -> Iterator[tuple[Array, float, float, bool]]:
        """Ends a recording: gives what is left of it, if it is long enough."""
        rows, start, last = self.rows, self.start, self.last
        self.rows, self.start = rows[:0], None
        if start is None or last is None:
            return
        inside = int((rows[:, 0] >= start).sum())
        moved = self._motion(rows, start)
        # The last part of a recording counts from 30 % of a window on, and with 50 rows.
        if len(moved) and moved[-1] >= 0.3 * self.window and inside >= 50:
            yield rows, start, last, True

    def _grow(self, rows: Array) -> Iterator[tuple[Array, float, float, bool]]:
        if len(rows) == 0:
            return
        self.rows = np.concatenate([self.rows, rows])
        if self.start is None:
            self.start = float(self.rows[0, 0])
        while (end := self._end(self.start)) is not None and self.rows[-1, 0] >= end + self.margin:
            t = self.rows[:, 0]
            stop = int(np.searchsorted(t, end + self.margin, side="right"))
            yield self.rows[:stop], self.start, end, False
            self.start = end
            self.rows = self.rows[int(np.searchsorted(t, end - self.margin)) :]

    def _end(self, start: float) -> float | None:
        """The time at which the window that starts at a time is complete [s]; None where it is not yet."""
        t = self.rows[:, 0]
        if t[-1] < start + self.window:
            return None
        moved = self._motion(self.rows, start)
        inside = t[t >= start]
        rested = inside - start - moved
        done = np.flatnonzero((moved >= self.window) | (inside >= start + LONGEST_WINDOW * self.window))
        if not len(done):
            return None
        return float(min(start + self.window + rested[done[0]], start + LONGEST_WINDOW * self.window))

    def _motion(self, rows: Array, start: float) -> Array:
        """Time [s] in which any joint has moved since the start, at each row from it on."""
        t, q = rows[:, 0], rows[:, 1 : 1 + len(self.slowest)]
        # Motion is the change of the positions over this time [s].
        back = max(1, round(0.2 / self.period)) if self.period else 1
        if len(t) <= back:
            return t[t >= start] - start
        speed = np.abs(q[back:] - q[:-back]) / (t[back:] - t[:-back])[:, None]
        moves = np.asarray((speed >= self.slowest).any(axis=1))
        # The first rows have none before them.
        moves = np.concatenate([np.repeat(moves[:1], back), moves])[t >= start]
        inside = t[t >= start]
        rest = np.where(moves[1:], 0.0, np.diff(inside))
        return np.asarray(inside - start - np.concatenate([[0.0], np.cumsum(rest)]))

    def restore(self, data: dict[str, Any]) -> None:
        """Reads `to_dict`."""
        width = self.rows.shape[1]
        self.__dict__.update(vars(StreamWindows.from_dict(data)))
        self.rows = self.rows.reshape(len(self.rows), width)
