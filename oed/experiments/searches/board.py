"""Progress of searches in other processes: one small file each, in a temporary folder."""

from __future__ import annotations

import math
import multiprocessing
import os
import signal
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

from robots.common.progress import Progress

# Often enough for a bar that looks alive.
INTERVAL = 0.25
STOP = "stop"


@dataclass(frozen=True)
class Board:
    """A folder that every process of this machine can reach, whatever executor runs it.

    Attributes:
        folder: holds one file a search: steps done, and the best value so far.
    """

    folder: Path

    def reporter(self, number: int) -> Callable[[int, float], None]:
        """Gives the function by which one search reports its steps and best value."""

        def tell(done: int, best: float) -> None:
            fresh = self.folder / f"{number}.new"
            try:
                fresh.write_text(f"{done} {best!r}", encoding="ascii")
                os.replace(fresh, self.folder / str(number))
            except OSError:
                pass  # on another machine of a cluster: progress is then coarse, the result the same

        return tell

    def stop(self) -> None:
        """Asks all searches to end with what they have."""
        (self.folder / STOP).touch()

    @property
    def stopped(self) -> bool:
        """Whether they are to end."""
        return os.path.exists(self.folder / STOP)

    def read(self) -> tuple[int, float]:
        """Sums the steps, and finds the best value."""
        done, best = 0, math.inf
        for file in self.folder.iterdir():
            if file.suffix != ".new" and file.name != STOP:
                steps, value = file.read_text(encoding="ascii").split()
                done, best = done + int(steps), min(best, float(value))
        return done, best

    @staticmethod
    @contextmanager
    def watched(searches: int, steps: int, progress: Progress, task: str, sign: float = 1.0) -> Iterator[Board]:
        """Opens a board and reports its progress until the work is over.

        Args:
            searches: number of searches.
            steps: of each.
            progress: receives the sum of the steps, and the best value.
            task: what the work is called.
            sign: -1 where the smaller value, which is the better, stands for a criterion that is to be large.
        """
        with tempfile.TemporaryDirectory(prefix="oed-") as folder:
            board, over = Board(Path(folder)), threading.Event()
            progress.start(task, float(searches * steps))

            def watch() -> None:
                while not over.wait(INTERVAL):
                    done, best = board.read()
                    progress.update(float(done), f"best {sign * best:.4g}" if done else "compiling and screening")

            thread = threading.Thread(target=watch, daemon=True)
            thread.start()
            try:
                yield board
            finally:
                over.set()
                thread.join()
                progress.finish()


@contextmanager
def stopped_by_interrupt(board: Board, *, wanted: bool) -> Iterator[None]:
    """Lets the first Ctrl-C meanwhile end the searches with what they have; the second is one as always.

    Only the main thread hears of signals: in another, and where it is not wanted, nothing changes.
    """
    if not wanted or threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.getsignal(signal.SIGINT)

    def first(_number: int, _frame: FrameType | None) -> None:
        signal.signal(signal.SIGINT, before)
        board.stop()

    signal.signal(signal.SIGINT, first)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def outlive_interrupts() -> None:
    """Makes a worker process deaf to Ctrl-C, which a terminal sends to the whole group: the board tells it to stop."""
    if multiprocessing.parent_process() is not None and threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_IGN)
