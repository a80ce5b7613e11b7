"""Progress of searches in other processes: one small file each, in a temporary folder; of a cluster by messages."""

from __future__ import annotations

import math
import multiprocessing
import os
import signal
import tempfile
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

from robots.common.clusters import ClusterExecutor, Link
from robots.common.progress import Progress

# Often enough for a bar that looks alive.
INTERVAL = 0.25
STOP = "stop"


@dataclass(frozen=True)
class Board:
    """A folder that every process of this machine can reach, and the way to it from a cluster's workers.

    Attributes:
        folder: holds one file a search: steps done, and the best value so far.
        link: from a cluster's workers, which may be other machines; None without a cluster.
    """

    folder: Path
    link: Link | None = None

    def reporter(self, number: int) -> Callable[[int, float], None]:
        """Gives the function by which one search reports its steps and best value."""

        def tell(done: int, best: float) -> None:
            if self.link is None:
                self.write(number, done, best)
            else:
                self.link.tell([number, done, float(best)])

        return tell

    def write(self, number: int, done: int, best: float) -> None:
        """Writes the steps and the best value of one search."""
        fresh = self.folder / f"{number}.new"
        try:
            fresh.write_text(f"{done} {best!r}", encoding="ascii")
            os.replace(fresh, self.folder / str(number))
        except OSError:
            pass  # the search is over, and the folder gone

    def stop(self) -> None:
        """Asks all searches to end with what they have."""
        (self.folder / STOP).touch()

    @property
    def stopped(self) -> bool:
        """Whether they are to end."""
        return os.path.exists(self.folder / STOP) or (self.link is not None and self.link.stopped)

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
    def watched(
        searches: int,
        steps: int,
        progress: Progress,
        task: str,
        sign: float = 1.0,
        executor: Executor | None = None,
    ) -> Iterator[Board]:
        """Opens a board and reports its progress until the work is over.

        Args:
            searches: number of searches.
            steps: of each.
            progress: receives the sum of the steps, and the best value.
            task: what the work is called.
            sign: -1 where the smaller value, which is the better, stands for a criterion that is to be large.
            executor: what runs the searches; None for processes of this machine.
        """
        with tempfile.TemporaryDirectory(prefix="oed-") as folder:
            cluster = executor if isinstance(executor, ClusterExecutor) else None
            local, over = Board(Path(folder)), threading.Event()
            board = Board(
                local.folder, None if cluster is None else cluster.link(lambda message: local.write(*message))
            )
            progress.start(task, float(searches * steps))

            def watch() -> None:
                asked = False
                while not over.wait(INTERVAL):
                    if cluster is not None and board.link is not None and board.stopped and not asked:
                        cluster.stop(board.link)
                        asked = True
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
    """Makes a worker process deaf to Ctrl-C, which a terminal sends to the whole group: the board asks it to stop."""
    if multiprocessing.parent_process() is not None and threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_IGN)
