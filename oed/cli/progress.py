"""A progress bar. The remaining time follows from the measured rate and is not shown before one is known."""

from __future__ import annotations

from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn, TimeRemainingColumn


class RichProgress:
    """Draws `robots.common.progress.Progress` calls on standard error."""

    def __init__(self) -> None:
        self._bars = Progress(
            TextColumn("{task.description}"),
            BarColumn(bar_width=30),
            TextColumn("{task.percentage:>3.0f} %"),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            TextColumn("{task.fields[note]}", markup=False),
            console=Console(stderr=True),
            transient=True,
        )
        self._task: TaskID | None = None

    def __enter__(self) -> RichProgress:
        self._bars.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bars.stop()

    def start(self, task: str, total: float | None = None) -> None:
        """Starts a task of `total` units, or of unknown length."""
        self.finish()
        self._task = self._bars.add_task(task, total=total, note="")

    def update(self, done: float, note: str = "") -> None:
        """Sets the number of units done and the current status."""
        if self._task is not None:
            self._bars.update(self._task, completed=done, note=note)

    def finish(self) -> None:
        """Ends the task."""
        if self._task is not None:
            self._bars.remove_task(self._task)
            self._task = None
