"""How long work reports its advance: a protocol of three calls, and a listener that ignores them."""

from __future__ import annotations

from typing import Protocol, runtime_checkable


@runtime_checkable
class Progress(Protocol):
    """A listener to long work, such as a progress bar.

    Library code calls ``start`` once, ``update`` as often as it likes, and ``finish`` once, also when the work fails.
    """

    def start(self, task: str, total: float | None = None) -> None:
        """Announces work.

        Args:
            task: what is being done, in a few words.
            total: the amount of work, in any unit; None where it is unknown.
        """

    def update(self, done: float, note: str = "") -> None:
        """Reports the advance.

        Args:
            done: the work done since ``start`` in the unit of ``total`` (an amount reached, not an increment).
            note: a word on the present state, such as the best value so far.
        """

    def finish(self) -> None:
        """Announces the end of the work, successful or not."""


class _Silent:
    """The listener that ignores everything."""

    def start(self, task: str, total: float | None = None) -> None:
        pass

    def update(self, done: float, note: str = "") -> None:
        pass

    def finish(self) -> None:
        pass

    def __repr__(self) -> str:
        return "SILENT"


SILENT: Progress = _Silent()
