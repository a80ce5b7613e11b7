"""Settings of all tests, and logs of real robots."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

# Tests run in several processes: a linear algebra library that starts a thread a core in each of them only waits.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

# Nor do a core's threads gain by the other core, which has tests of its own: they wait for each other.
if (_worker := os.environ.get("PYTEST_XDIST_WORKER", "gw")[2:]) and hasattr(os, "sched_setaffinity"):
    _cores = sorted(os.sched_getaffinity(0))
    os.sched_setaffinity(0, {_cores[int(_worker) % len(_cores)]})

# Programs that tests start need not compile the packages anew each time.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# A shell ignores Ctrl-C for what it starts in the background, and so would the tests of Ctrl-C.
signal.signal(signal.SIGINT, signal.default_int_handler)

DATA = Path(__file__).parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def data() -> Callable[[str], Path]:
    """Find a folder of measured logs, or skip."""

    def find(name: str) -> Path:
        folder = DATA / name
        if not folder.is_dir():
            pytest.skip(f"the measured logs of {name} are not at hand ({folder})")
        return folder

    return find


@pytest.fixture(scope="session")
def dask_cluster() -> Iterator[Any]:
    """A Dask scheduler and two workers in processes of their own, on loopback, or skip."""
    distributed = pytest.importorskip("distributed", reason="a cluster needs the package distributed")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address="127.0.0.1:0") as cluster:
        yield cluster


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave out what would take the tests beyond ten minutes, unless it is asked for."""
    if os.environ.get("LONGER"):
        return
    for item in items:
        if item.get_closest_marker("longer"):
            item.add_marker(pytest.mark.skip(reason="takes minutes more; set LONGER=1"))
