"""One function over many items: in this process, in processes, or by any executor of ``concurrent.futures``."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, contextmanager
from itertools import islice
from multiprocessing.synchronize import Event
from typing import TypeVar

from robots.common.errors import InputError, OedError
from robots.common.progress import SILENT, Progress
from robots.common.workers import start_worker

Item = TypeVar("Item")
Result = TypeVar("Result")

MOST_LOSSES = 2
"""Worker processes may end abruptly so often in a row without a finished item between; then it is no accident."""

BLAS_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "BLIS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMEXPR_NUM_THREADS",
)


class _Marks:
    worker = False


_marks = _Marks()


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

    See `as_finished` for where the work is done. The results are the same there, to the last bit, as long as
    ``function`` depends on its item alone and holds BLAS to one thread (`one_blas_thread`).

    Args:
        function: what to do with one item.
        items: the items.
        executor: any executor, such as that of `robots.common.clusters.cluster`; it is left running.
        workers: the number of processes where no executor is given; None for one per available core.
        progress: receives the number of finished items.
        task: the name of the work for ``progress``.

    Returns:
        One result per item, in order.

    Raises:
        InputError: ``workers`` is below 1.
        OedError: worker processes died again and again (out of memory, or a script without a main guard).
        Exception: whatever ``function`` raised, as it was.
    """
    work = list(items)
    progress = progress or SILENT
    require_workers(workers)
    progress.start(task, float(len(work)))
    results: dict[int, Result] = {}
    try:
        with closing(as_finished(function, work, executor=executor, workers=workers)) as finished:
            for number, result in finished:
                results[number] = result
                progress.update(float(len(results)))
    finally:
        progress.finish()
    return [results[number] for number in range(len(work))]


def as_finished(
    function: Callable[[Item], Result],
    items: Iterable[Item],
    *,
    executor: Executor | None = None,
    workers: int | None = None,
) -> Generator[tuple[int, Result], None, None]:
    """Applies a function to every item and gives each result as it comes, for work that keeps what is done.

    Without an executor, spawned processes do the work, each with one BLAS thread; ``function`` and the items must
    then pickle. A single item, or ``workers=1``, is worked on in this process. After the first failure, on an
    interrupt, and where the generator is closed, what has not begun is cancelled.

    If a worker process ends abruptly, such as for lack of memory, its item and those of the other workers are worked
    on again, after all others.

    Args:
        function: what to do with one item.
        items: the items.
        executor: any executor; it is left running.
        workers: the number of processes where no executor is given; None for one per available core.

    Yields:
        The number of an item, from 0, and its result.

    Raises:
        InputError: ``workers`` is below 1.
        OedError: worker processes died again and again without a finished item between.
        Exception: whatever ``function`` raised, as it was.
    """
    work = list(items)
    require_workers(workers)
    count = min(workers or available_cores(), len(work))
    if executor is not None:
        yield from _by_executor(executor, function, work)
    elif count <= 1:
        yield from ((number, function(item)) for number, item in enumerate(work))
    else:
        yield from _by_processes(function, work, count)


def require_workers(workers: int | None) -> None:
    """Refuses a number of workers below 1.

    Raises:
        InputError: it is.
    """
    if workers is not None and workers < 1:
        raise InputError(f"{workers} workers", allowed="1 or more")


def threaded(function: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
    """Applies a function on some threads and gives the results in order, a few ahead of who takes them.

    Compiled code, linear algebra and filters leave Python's lock; sums taken in order come out alike on any machine.
    One of several workers has one thread: the other cores are busy.
    """
    # More threads than this wait for memory.
    threads = 1 if is_worker() else min(available_cores(), 4)
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


def is_worker() -> bool:
    """Whether this process is one of several that work side by side, so that its other cores are busy."""
    return _marks.worker or multiprocessing.parent_process() is not None


def mark_as_worker() -> None:
    """Says that this process is one of several, where its parent does not show it, as for a cluster's worker."""
    _marks.worker = True


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


def _by_processes(
    function: Callable[[Item], Result], work: Sequence[Item], count: int
) -> Generator[tuple[int, Result], None, None]:
    context = multiprocessing.get_context("spawn")
    left, losses = list(range(len(work))), 0
    while left:
        begun, before, lost = context.Event(), len(left), False
        pool = ProcessPoolExecutor(
            min(count, len(left)), mp_context=context, initializer=_begin_worker, initargs=(begun,)
        )
        try:
            # Workers start during submission, one at a time, and inherit the environment of that moment.
            with single_blas_thread():
                futures = _submitted(pool, function, [work[number] for number in left])
            numbers = dict(zip(futures, left, strict=True))
            for future in as_completed(futures):
                try:
                    result = future.result()
                except BrokenProcessPool:
                    lost = True
                    continue
                left.remove(numbers[future])
                yield numbers[future], result
        except BrokenProcessPool:  # during submission
            lost = True
        finally:
            pool.shutdown(wait=True, cancel_futures=True)
        if lost:
            losses = losses + 1 if len(left) == before else 1
            _require_accident(begun, losses)
            # One item more than there are workers is under way: the culprit is among them.
            under_way = count + 1
            left = left[under_way:] + left[:under_way]


def _require_accident(begun: Event, losses: int) -> None:
    """Ends work that would lose its workers for ever.

    Raises:
        OedError: no worker has begun, or too many were lost in a row.
    """
    if not begun.is_set():
        raise OedError(
            "the worker processes ended before their work began",
            remedy="a script must start its work under `if __name__ == '__main__':`; else the reason stands above",
        )
    if losses > MOST_LOSSES:
        raise OedError(
            f"worker processes ended abruptly, {losses} times in a row",
            remedy="memory may have run out: use fewer workers; with --workers 1 the work runs in the main process",
        )


def _begin_worker(begun: Event) -> None:
    start_worker()
    begun.set()


def _by_executor(
    executor: Executor, function: Callable[[Item], Result], work: Sequence[Item]
) -> Generator[tuple[int, Result], None, None]:
    futures = _submitted(executor, function, work)
    numbers = {future: number for number, future in enumerate(futures)}
    try:
        for future in as_completed(futures):
            yield numbers[future], future.result()
    finally:
        _cancel(futures)


def _submitted(executor: Executor, function: Callable[[Item], Result], work: Sequence[Item]) -> list[Future[Result]]:
    futures: list[Future[Result]] = []
    try:
        for item in work:
            futures.append(executor.submit(function, item))
    except BaseException:
        _cancel(futures)
        raise
    return futures


def _cancel(futures: Iterable[Future[Result]]) -> None:
    for future in futures:
        future.cancel()
