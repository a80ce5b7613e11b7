"""The campaign of the thesis through the virtual robot: 2 h at 4 ms, its time and its memory.

Run it with ``python benchmarks/campaign.py``. It plans 24 cycles of 5 min for the er3a, writes the stages, reads them
back, plays them and writes a log for each cycle, each step timed; memory is the peak of the whole process until then.
"""

from __future__ import annotations

import platform
import resource
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np

import oed
from oed.campaigns import Campaign, record
from robots.common.errors import AssumedValueWarning
from robots.loading import load_robot

T = TypeVar("T")

HOURS = 2.0
PERIOD = 0.004


def timed(what: str, work: Callable[[], T]) -> T:
    start = time.perf_counter()
    result = work()
    seconds = time.perf_counter() - start
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024  # kB on Linux
    print(f"{what:38s} {seconds:7.1f} s   peak memory {peak:6.0f} MB")
    return result


def main() -> int:
    warnings.simplefilter("ignore", AssumedValueWarning)
    print(f"Python {platform.python_version()}, numpy {np.__version__}")
    robot = load_robot("er3a")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        design = timed("quick design", lambda: oed.design(robot, search=oed.SearchOptions(effort="quick", workers=1)))
        planned = timed("plan of 24 cycles, all stages checked", lambda: oed.campaign(robot, design=design))
        timed("stages written", lambda: planned.save(folder))
        loaded = timed("stages read back", lambda: Campaign.load(folder))
        timed("stages checked again", loaded.check)
        logs = timed("played and logged", lambda: record(loaded, folder / "logs"))
        size = sum((folder / "logs" / log).stat().st_size for log in logs) / 2**20
    print(f"\n{len(logs)} logs, {loaded.samples} samples, {loaded.duration / 3600:.3f} h, {size:.0f} MB of Parquet")
    return int(loaded.samples != round(HOURS * 3600 / PERIOD) or not loaded.success)


if __name__ == "__main__":
    sys.exit(main())
