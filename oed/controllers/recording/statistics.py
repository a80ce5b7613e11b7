"""Rate, loss and jitter of feedback, counted as it comes."""

from __future__ import annotations

from typing import Any

import numpy as np


class Statistics:
    """Counts without keeping: its memory does not grow.

    Args:
        reliable: whether the link loses nothing, as TCP. Stamps that jitter are no gaps then.
    """

    def __init__(self, reliable: bool = False) -> None:
        self._reliable = reliable
        self.rows = self.late = self.lost = self.malformed = 0
        self.stamped = False
        self._steps: list[float] = []
        self._period: float | None = None
        self._last: tuple[float, float] | None = None
        self._count, self._mean, self._squares, self._longest = 0, 0.0, 0.0, 0.0

    def add(self, t: float, arrival: float) -> None:
        """Counts a row.

        Args:
            t: its time stamp [s].
            arrival: when it came, on our clock [s].
        """
        self.rows += 1
        if self._last is not None:
            self._step(t - self._last[0])
            gap = arrival - self._last[1]
            self._count += 1
            change = gap - self._mean
            self._mean += change / self._count
            self._squares += change * (gap - self._mean)
            self._longest = max(self._longest, gap)
        self._last = (t, arrival)

    def _step(self, step: float) -> None:
        if self._period is None:
            self._steps.append(step)
            # Steps from which the nominal period is taken.
            if len(self._steps) >= 50:
                self._settle()
        else:
            self._lose(step)

    def _settle(self) -> None:
        self._period = float(np.median(self._steps))
        for step in self._steps:
            self._lose(step)
        self._steps.clear()

    def _lose(self, step: float) -> None:
        # Times of arrival jitter: only the controller's own stamps show what is missing.
        if self.stamped and self._period and not self._reliable:
            self.lost += max(0, round(step / self._period) - 1)

    @property
    def end(self) -> float | None:
        """Time stamp of the last row [s]; None without rows."""
        return None if self._last is None else self._last[0]

    @property
    def period(self) -> float | None:
        """The usual time between two rows [s]."""
        if self._period is None and self._steps:
            return float(np.median(self._steps))
        return self._period

    def summary(self) -> dict[str, Any]:
        """Gives counts and times [s]; loss is null where feedback carries no time."""
        if self._period is None and self._steps:
            self._settle()
        return {
            "rows": self.rows,
            "period": self.period,
            "lost": self.lost if self.stamped else None,
            "late_or_twice": self.late,
            "malformed": self.malformed,
            "arrival_jitter": float(np.sqrt(self._squares / self._count)) if self._count else None,
            "longest_gap": self._longest if self._count else None,
        }
