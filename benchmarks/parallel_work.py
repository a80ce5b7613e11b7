"""The options ``--workers`` and ``--cluster`` of the benchmarks, with the meaning they have for ``oed``."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from typing import TypeVar

from oed.cli.options.work import Processes
from robots.common.parallel import as_finished

Item = TypeVar("Item")
Result = TypeVar("Result")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Adds both options."""
    parser.add_argument("--workers", type=int, help="number of parallel processes; one per core by default")
    parser.add_argument("--cluster", metavar="ADDRESS", help="address of a Dask scheduler; its workers start here")


def finished(
    function: Callable[[Item], Result], tasks: Iterable[Item], options: argparse.Namespace
) -> Iterator[tuple[int, Result]]:
    """Gives each result with the number of its task as it comes, so that an interrupt costs what is under way alone."""
    with (
        Processes(workers=options.workers, cluster=options.cluster).executor() as executor,
        closing(as_finished(function, tasks, executor=executor, workers=options.workers)) as results,
    ):
        yield from results
