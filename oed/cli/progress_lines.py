"""Progress where standard error is no terminal: a line now and then, so that a log shows that work goes on."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

EVERY = 10.0
"""Least time between two lines, and before the first one [s]: short work stays silent."""


class ProgressLines:
    """Writes `robots.common.progress.Progress` calls as lines on standard error.

    Args:
        every: least time between two lines [s].
        clock: gives the time [s].
    """

    def __init__(self, every: float = EVERY, clock: Callable[[], float] = time.monotonic) -> None:
        self._every, self._clock = every, clock
        self._begin = self._last = clock()
        self._task = ""
        self._total: float | None = None

    def start(self, task: str, total: float | None = None) -> None:
        """Starts a task of `total` units, or of unknown length."""
        self._task, self._total = task, total
        self._write("")

    def update(self, done: float, note: str = "") -> None:
        """Sets the number of units done and the current status."""
        share = f"{100 * min(done / self._total, 1.0):.0f} %" if self._total else ""
        self._write(", ".join(filter(None, [share, note])))

    def finish(self) -> None:
        """Ends the task."""
        self._task = ""

    def _write(self, state: str) -> None:
        now = self._clock()
        if not self._task or now - self._last < self._every:
            return
        self._last = now
        text = ": ".join(filter(None, [self._task, state]))
        print(f"progress: {text} ({now - self._begin:.0f} s since the start)", file=sys.stderr, flush=True)
