"""How much faster multi-start designs and diagnoses are on two workers: processes, and a Dask cluster on loopback.

Run it with ``python benchmarks/parallel_scaling.py [--cases 8] [--islands 8]`` on an idle machine. Each kind of
work is done by one worker on one core, by two processes, and by two workers of a Dask scheduler. Start-up of the
workers counts for processes, since each run starts them; a cluster stands before. Results must be the same to the last
bit. A single diagnosis forks its scans over all cores, so one worker that has both cores is timed, too.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
import warnings
from collections.abc import Callable
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

from benchmarks.frozen_parts.diagnoses import CASES, run_case  # noqa: E402
from oed.experiments import Effort, ModelOptions, SearchOptions, design  # noqa: E402
from robots.common.clusters import cluster  # noqa: E402
from robots.common.errors import AssumedValueWarning  # noqa: E402
from robots.common.parallel import available_cores, parallel_map  # noqa: E402
from robots.loading import load_robot  # noqa: E402


def designs(islands: int, workers: int | None, executor: Executor | None) -> Any:
    """A multi-start design of the er3a; gives what must be the same."""
    effort = Effort(islands=islands, starts=8, screened=400, hops=8)
    search = SearchOptions(effort=effort, workers=workers, executor=executor)
    found = design(load_robot("er3a"), model=ModelOptions(friction="coulomb-viscous"), search=search)
    return found.to_dict()


def diagnoses(cases: int, workers: int | None, executor: Executor | None) -> Any:
    """Diagnoses of the benchmark's cases; gives what must be the same."""
    tasks = CASES[:: max(1, len(CASES) // cases)][:cases]
    rows = parallel_map(run_case, tasks, workers=workers, executor=executor)
    return rows


def measure(name: str, work: Callable[[int | None, Executor | None], Any], address: str) -> None:
    """Prints the times of one kind of work."""
    times, results = {}, []
    cores = os.sched_getaffinity(0)
    for how in ("1 core", "1 worker on both cores", "2 processes", "2 Dask workers"):
        os.sched_setaffinity(0, {min(cores)} if how == "1 core" else cores)
        start = time.perf_counter()
        if how == "2 Dask workers":
            with cluster(address) as executor:
                results.append(work(None, executor))
        else:
            results.append(work(int(how[0]), None))
        times[how] = time.perf_counter() - start
    same = "the same" if all(result == results[0] for result in results) else "NOT the same"
    listed = ", ".join(f"{how} {seconds:.1f} s" for how, seconds in times.items())
    print(
        f"{name}: {listed}; {times['1 core'] / times['2 processes']:.2f} times as fast on two processes, Dask takes "
        f"{times['2 Dask workers'] / times['2 processes']:.2f} of their time; results are {same}"
    )


def main() -> int:
    from distributed import LocalCluster

    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--cases", type=int, default=8, help="cases of the diagnosis")
    parser.add_argument("--islands", type=int, default=8, help="searches of the design")
    options = parser.parse_args()
    warnings.simplefilter("ignore", AssumedValueWarning)
    print(f"{available_cores()} cores, load {os.getloadavg()[0]:.1f} before")
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address="127.0.0.1:0") as dask:
        address = dask.scheduler_address
        measure("design", lambda workers, executor: designs(options.islands, workers, executor), address)
        measure("diagnosis", lambda workers, executor: diagnoses(options.cases, workers, executor), address)
    return 0


if __name__ == "__main__":
    sys.exit(main())
