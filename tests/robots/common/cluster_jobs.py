"""Work for the workers of a test's cluster, which import it by name."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np

from robots.common.clusters import Link
from robots.common.errors import InfeasibleError


def solved(seed: int) -> np.ndarray:
    """The solution of a random system, whose last bits depend on the threads of BLAS."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(300, 300))
    return np.linalg.solve(A @ A.T, rng.normal(size=300))


def solved_slowly(task: tuple[Path, int]) -> np.ndarray:
    """Leaves a file that says which process works on it, and takes a moment."""
    folder, seed = task
    (folder / f"{seed}.{os.getpid()}").touch()
    time.sleep(0.4)
    return solved(seed)


def dies_once(task: tuple[Path, int]) -> int:
    """Ends its process at the first try of item 1."""
    folder, number = task
    flag = folder / "died"
    if number == 1 and not flag.exists():
        flag.touch()
        os._exit(9)
    return number * number


def dies(_: int) -> None:
    """Ends its process."""
    os._exit(9)


def fail(number: int) -> int:
    """Fails for item 1."""
    if number == 1:
        raise InfeasibleError("no motion", joint=2)
    return number


def until_stopped(task: tuple[Link, int]) -> int:
    """Sends its number, then works until it is asked to end."""
    link, number = task
    link.tell([number, 0.5])
    begin = time.monotonic()
    while not link.stopped:
        assert time.monotonic() < begin + 30
        time.sleep(0.01)
    return number


def set_version(version: str) -> str:
    """Changes the version of robot-oed in this process, and returns the former one."""
    import robots.version

    before, robots.version.VERSION = robots.version.VERSION, version
    return before
