"""Progress of a part of a longer work."""

from __future__ import annotations

import time

from robots.common.progress import Progress

PROGRESS_PERIOD = 0.5
"""While the robot rests, the progress is updated so often [s]."""


class StageProgress:
    """Turns points of a stream into seconds of the timetable.

    Args:
        whole: listener to the campaign.
        start: of the stage [s].
        duration: of the stage [s].
        note: what is played.
    """

    def __init__(self, whole: Progress, start: float, duration: float, note: str) -> None:
        self._whole, self._start, self._duration, self._note = whole, start, duration, note
        self._total = 1.0

    def start(self, task: str, total: float | None = None) -> None:
        """Notes the number of points."""
        self._total = total or 1.0
        self.update(0.0)

    def update(self, done: float, note: str = "") -> None:
        """Reports the time of the points so far."""
        self._whole.update(self._start + self._duration * done / self._total, self._note)

    def finish(self) -> None:
        """Leaves the campaign's progress as it is."""


class TitledProgress:
    """Says at the front of each task what it is a part of.

    Args:
        listener: to the whole.
        title: in a few words.
    """

    def __init__(self, listener: Progress, title: str) -> None:
        self._listener, self._title = listener, title

    def start(self, task: str, total: float | None = None) -> None:
        """Announces a task."""
        self._listener.start(f"{self._title}: {task}", total)

    def update(self, done: float, note: str = "") -> None:
        """Reports the advance."""
        self._listener.update(done, note)

    def finish(self) -> None:
        """Announces the end of the task."""
        self._listener.finish()


def rest(until: float, progress: Progress, title: str) -> None:
    """Waits, and shows how long.

    Args:
        until: seconds since 1970.
        progress: listener.
        title: of the work, in a few words.
    """
    whole = until - time.time()
    if whole <= 0:
        return
    progress.start(f"{title}: rest", whole)
    try:
        while (left := until - time.time()) > 0:
            progress.update(whole - left)
            time.sleep(min(left, PROGRESS_PERIOD))
    finally:
        progress.finish()
