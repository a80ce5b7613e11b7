"""What a killed program leaves behind: no locks, and no workers."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from robots.common.locks import close_locked, lock

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="processes are forked on Linux only"),
]

LOCKED = """
import os, signal, sys, time
from robots.common.locks import lock
lock(os.open(sys.argv[1], os.O_RDWR | os.O_CREAT))
child = os.fork()
if not child:
    os.closerange(0, 3)
    time.sleep(60)
print(child, flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""

WORKING = """
import os, sys, time
from pathlib import Path
from robots.common import forks, parallel
forks.available_cores = parallel.available_cores = lambda: 2

def work(k):
    # A name appears with its content only.
    part = Path(sys.argv[1]) / f".{os.getpid()}"
    part.touch()
    part.rename(part.with_name(str(os.getpid())))
    time.sleep(60 if k < 3 else 0)

if __name__ == "__main__":
    if sys.argv[2] == "fork":
        forks.forked(work, range(8))
    else:
        parallel.parallel_map(work, range(8), workers=2)
"""


def ended(process: int) -> bool:
    """Whether a process is gone, or is left only for its parent to collect."""
    try:
        state = Path(f"/proc/{process}/stat").read_text()
    except OSError:
        return True
    return state.rpartition(")")[2].split()[0] == "Z"


def test_a_lock_ends_with_its_program(tmp_path: Path) -> None:
    """A process that a locked program had started does not keep the lock."""
    path = tmp_path / "lock"
    done = subprocess.run([sys.executable, "-c", LOCKED, path], capture_output=True, text=True, check=False, timeout=60)
    number = os.open(path, os.O_RDWR)
    try:
        lock(number)
    finally:
        close_locked(number)
        os.kill(int(done.stdout), 9)


@pytest.mark.parametrize("way", ["fork", "spawn"])
def test_workers_end_with_a_killed_program(way: str, tmp_path: Path) -> None:
    """The workers of a program that was killed end soon after it."""
    script = tmp_path / "work.py"
    script.write_text(WORKING)
    pids = tmp_path / "pids"
    pids.mkdir()
    root = Path(__file__).parents[3]
    process = subprocess.Popen([sys.executable, script, pids, way], env={**os.environ, "PYTHONPATH": str(root)})
    workers: list[int] = []
    try:
        end = time.monotonic() + 60
        while len(workers) < 2 and time.monotonic() < end:
            time.sleep(0.02)
            workers = [int(path.name) for path in pids.glob("[0-9]*")]
        assert len(workers) == 2
        process.kill()
        process.wait()
        end = time.monotonic() + 10
        while not all(map(ended, workers)) and time.monotonic() < end:
            time.sleep(0.02)
        assert all(map(ended, workers))
    finally:
        process.kill()
        for worker in workers:
            with suppress(ProcessLookupError):
                os.kill(worker, 9)
