"""One function over many items in copies of this process, which need not be sent the data."""

from __future__ import annotations

import gc
import multiprocessing
import sys
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from itertools import count, repeat
from typing import Any, TypeVar

from robots.common.parallel import available_cores, is_worker, threaded
from robots.common.workers import give_back, start_worker

Item = TypeVar("Item")
Result = TypeVar("Result")

ITEMS_PER_RETURN = 20
"""Items after which a process returns freed memory to the system."""

_work: dict[int, tuple[Callable[[Any], Any], Sequence[Any]]] = {}
_numbers = count()


def forked(
    function: Callable[[Item], Result],
    items: Iterable[Item],
    advance: Callable[[float], None] = lambda share: None,
    *,
    chunk: int = 1,
    threads: bool = True,
) -> list[Result]:
    """Applies a function to every item in forked processes, one per core, and returns the results in order.

    A fork shares the data of this process without a copy, so only the results must pickle. Threads do the work where
    processes cannot be forked safely (Windows, macOS), and if a fork dies. Where this process is itself one of several
    workers, the work is done in it.

    Args:
        function: what to do with one item; any closure.
        items: the items.
        advance: is called with the share of the items that are done.
        chunk: number of items that a process takes at once: more for items that are done in milliseconds.
        threads: whether the function may run in several threads; IPOPT may not.

    Returns:
        One result per item, in order.
    """
    work = list(items)
    cores = min(available_cores(), -(-len(work) // chunk))
    # The other cores are busy if this process is one of several workers.
    if cores > 1 and sys.platform.startswith("linux") and not is_worker():
        try:
            return _in_forks(function, work, cores, advance, chunk)
        except BrokenProcessPool:
            pass
    results = []
    for result in threaded(function, work) if threads else map(function, work):
        results.append(result)
        if len(results) % ITEMS_PER_RETURN == 0:
            give_back()
        advance(len(results) / len(work))
    return results


def _in_forks(
    function: Callable[[Item], Result],
    work: Sequence[Item],
    cores: int,
    advance: Callable[[float], None],
    chunk: int,
) -> list[Result]:
    number = next(_numbers)
    _work[number] = function, work
    # Objects that the collector of a child does not visit stay in pages that are shared.
    gc.freeze()
    pool = ProcessPoolExecutor(cores, mp_context=multiprocessing.get_context("fork"), initializer=start_worker)
    try:
        results: list[Result] = []
        for some in pool.map(_apply, repeat(number), range(0, len(work), chunk), repeat(chunk)):
            results += some
            advance(len(results) / len(work))
        return results
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
        gc.unfreeze()
        del _work[number]


def _apply(number: int, start: int, chunk: int) -> list[Any]:
    function, work = _work[number]
    results = [function(item) for item in work[start : start + chunk]]
    if start % ITEMS_PER_RETURN < chunk:
        give_back()
    return results
