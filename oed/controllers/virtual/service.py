"""A loop that runs in the foreground or in a thread until it is stopped."""

from __future__ import annotations

import threading
import time
from abc import ABC, abstractmethod
from typing import Self


class Service(ABC):
    """Runs turn after turn."""

    def __init__(self) -> None:
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None

    @abstractmethod
    def _turn(self) -> None:
        """Does what is due, and waits a little for something to do."""

    @abstractmethod
    def _close(self) -> None:
        """Closes the ports."""

    def run(self) -> None:
        """Runs until `stop`."""
        while not self._stopping.is_set():
            self._turn()

    def serve(self, duration: float | None = None) -> None:
        """Runs until Ctrl-C, or for a time, and closes the ports.

        Args:
            duration: how long [s]; None for ever.
        """
        end = None if duration is None else time.monotonic() + duration
        try:
            while end is None or time.monotonic() < end:
                self._turn()
        except KeyboardInterrupt:
            pass
        finally:
            self.stop()

    def start(self) -> None:
        """Runs in a thread."""
        self._thread = threading.Thread(target=self.run, name="virtual controller", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Ends `run`, and closes the ports."""
        self._stopping.set()
        if self._thread is not None:
            self._thread.join()
        self._close()

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()
