"""Forked processes share data, keep the order, pass errors on, and are replaced by threads where they cannot be."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading

import numpy as np
import pytest

from robots.common import forks, parallel
from robots.common.errors import InputError
from robots.common.forks import forked

linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="processes are forked on Linux only")


@pytest.fixture(autouse=True)
def two_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(forks, "available_cores", lambda: 2)


@linux
def test_results_come_in_order_from_other_processes_that_see_this_one() -> None:
    """A closure over unpicklable data works; each result says which process made it."""
    data, unpicklable = np.arange(30.0), open(os.devnull)  # noqa: SIM115
    shares: list[float] = []

    def square(k: int) -> tuple[float, int, int]:
        return float(data[k] ** 2), os.getpid(), unpicklable.fileno()

    results = forked(square, range(30), shares.append, chunk=4)
    unpicklable.close()
    assert [value for value, *_ in results] == [float(k**2) for k in range(30)]
    assert os.getpid() not in {process for _, process, _ in results}
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_no_items_give_no_results() -> None:
    assert forked(str, []) == []


@linux
def test_large_arrays_come_back_as_they_were() -> None:
    """Their values, order in memory and type are kept, they can be written to, and empty ones come back too."""

    def arrays(k: int) -> list[np.ndarray]:
        whole = np.arange(60_000.0).reshape(300, 200) + k
        return [whole, np.asfortranarray(whole), whole[::2, 3:9], whole.astype(np.float32)[:, :1], whole[:0]]

    for k, found in enumerate(forked(arrays, range(5), chunk=2)):
        for array, expected in zip(found, arrays(k), strict=True):
            np.testing.assert_array_equal(array, expected)
            assert array.dtype == expected.dtype
            array += 1.0
        assert found[1].flags.f_contiguous


@linux
def test_an_error_comes_back_as_it_was() -> None:
    def refuse(k: int) -> int:
        if k == 3:
            raise InputError(f"item {k}", allowed="another")
        return k

    with pytest.raises(InputError, match="item 3") as caught:
        forked(refuse, range(6))
    assert caught.value.allowed == "another"


@linux
def test_threads_do_the_work_of_a_process_that_was_killed() -> None:
    """A process that the system ends, as it does where memory runs out, costs its time only."""
    here = os.getpid()

    def fragile(k: int) -> int:
        if k == 5 and os.getpid() != here:
            os.kill(os.getpid(), signal.SIGKILL)
        return 10 * k

    assert forked(fragile, range(8)) == [10 * k for k in range(8)]


@linux
def test_a_worker_process_does_not_fork(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(multiprocessing, "parent_process", lambda: object())
    assert set(forked(lambda k: os.getpid(), range(8))) == {os.getpid()}


def test_workers_of_a_cluster_do_not_fork(monkeypatch: pytest.MonkeyPatch) -> None:
    """A process that is marked as one of several workers does the work itself, in one thread."""
    monkeypatch.setattr(parallel._marks, "worker", False)
    monkeypatch.setattr(parallel, "available_cores", lambda: 4)
    parallel.mark_as_worker()
    places = set(forked(lambda _: (os.getpid(), threading.get_ident()), range(8)))
    assert places == {(os.getpid(), threading.get_ident())}


@linux
def test_a_worker_ends_by_a_signal_that_this_process_handles() -> None:
    """An order to terminate ends a worker whose parent would go on; threads do its work."""
    here = os.getpid()

    def ordered(k: int) -> int:
        if os.getpid() != here:
            os.kill(os.getpid(), signal.SIGTERM)
        return 10 * k

    heard: list[int] = []
    before = signal.signal(signal.SIGTERM, lambda number, _: heard.append(number))
    try:
        assert forked(ordered, range(4)) == [0, 10, 20, 30]
        assert forked(lambda _: signal.getsignal(signal.SIGTERM) == signal.SIG_DFL, range(4)) == [True] * 4
    finally:
        signal.signal(signal.SIGTERM, before)
    assert heard == []
