"""One function over many items, by any executor of ``concurrent.futures``."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from itertools import islice
from typing import TypeVar

from robots.common.errors import InputError, OedError
from robots.common.progress import SILENT, Progress

Item = TypeVar("Item")
Result = TypeVar("Result")

MOST_THREADS = 4
"""More threads than this wait for memory."""

BLAS_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "BLIS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMEXPR_NUM_THREADS",
)


def parallel_map(
    function: Callable[[Item], Result],
    items: Iterable[Item],
    *,
    executor: Executor | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
    task: str = "working",
) -> list[Result]:
    """Applies a function to every item and returns the results in the order of the items.

    Without an executor, spawned processes do the work, each with one BLAS thread; ``function`` and the items must
    then pickle. A single item, or ``workers=1``, is worked on in this process. After the first failure, and on an
    interrupt, what has not begun is cancelled.

    Args:
        function: what to do with one item.
        items: the items.
        executor: any executor, such as that of a Dask client; it is left running.
        workers: the number of processes where no executor is given; None for one per available core.
        progress: receives the number of finished items.
        task: the name of the work for ``progress``.

    Returns:
        One result per item, in order.

    Raises:
        InputError: ``workers`` is below 1.
        OedError: a worker process died (out of memory, or a script without a main guard).
        Exception: whatever ``function`` raised, as it was.
    """
    work = list(items)
    progress = progress or SILENT
    if workers is not None and workers < 1:
        raise InputError(f"{workers} workers", allowed="1 or more")
    count = min(workers or available_cores(), len(work))
    progress.start(task, float(len(work)))
    try:
        if executor is not None:
            return _collect(_submit(executor, function, work), progress)
        if count <= 1:
            return _map_here(function, work, progress)
        return _map_in_processes(function, work, count, progress)
    finally:
        progress.finish()


def threaded(function: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
    """Applies a function on some threads and gives the results in order, a few ahead of who takes them.

    Compiled code, linear algebra and filters leave Python's lock; sums taken in order come out alike on any machine.
    """
    threads = min(available_cores(), MOST_THREADS)
    if threads == 1:
        yield from map(function, items)
        return
    queue = iter(items)
    with ThreadPoolExecutor(threads) as pool:
        pending = [pool.submit(function, item) for item in islice(queue, 2 * threads)]
        try:
            while pending:
                result = pending.pop(0).result()
                pending.extend(pool.submit(function, item) for item in islice(queue, 1))
                yield result
        finally:
            for future in pending:
                future.cancel()


def available_cores() -> int:
    """Returns the number of cores that this process may use, at least 1."""
    if hasattr(os, "sched_getaffinity"):
        return max(1, len(os.sched_getaffinity(0)))
    return os.cpu_count() or 1


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Holds BLAS in this process to one thread meanwhile; it decorates functions, too.

    On matrices of some hundred columns more threads gain nothing, and on a busy machine they wait for each other ten
    times as long as they work. Sums also come out alike, bit by bit, here and in a worker process.
    """
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):
        yield


@contextmanager
def single_blas_thread() -> Iterator[None]:
    """Sets the environment so that processes started meanwhile use one BLAS thread, and restores it."""
    before = {name: os.environ.get(name) for name in BLAS_VARIABLES}
    os.environ.update(dict.fromkeys(BLAS_VARIABLES, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _map_here(function: Callable[[Item], Result], work: Sequence[Item], progress: Progress) -> list[Result]:
    results = []
    for item in work:
        results.append(function(item))
        progress.update(float(len(results)))
    return results


def _map_in_processes(
    function: Callable[[Item], Result], work: Sequence[Item], count: int, progress: Progress
) -> list[Result]:
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(count, mp_context=context, initializer=start_worker)
    try:
        # Workers start during submission, one at a time, and inherit the environment of that moment.
        with single_blas_thread():
            futures = _submit(pool, function, work)
        return _collect(futures, progress)
    except BrokenProcessPool as error:
        raise OedError(
            "a worker process ended abruptly",
            remedy="a script must start its work under `if __name__ == '__main__':`; if it does, memory may have run "
            "out: use fewer workers",
        ) from error
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def start_worker() -> None:
    """Prepares a worker process for interrupts."""
    # A terminal interrupts the whole process group: workers then end at once, without a traceback each.
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def _submit(executor: Executor, function: Callable[[Item], Result], work: Sequence[Item]) -> list[Future[Result]]:
    futures: list[Future[Result]] = []
    try:
        for item in work:
            futures.append(executor.submit(function, item))
    except BaseException:
        _cancel(futures)
        raise
    return futures


def _collect(futures: Sequence[Future[Result]], progress: Progress) -> list[Result]:
    try:
        for done, future in enumerate(as_completed(futures), start=1):
            future.result()
            progress.update(float(done))
        return [future.result() for future in futures]
    except BaseException:
        _cancel(futures)
        raise


def _cancel(futures: Iterable[Future[Result]]) -> None:
    for future in futures:
        future.cancel()
