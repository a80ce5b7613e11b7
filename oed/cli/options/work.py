"""Options of random numbers and of parallel work."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar

from robots.common.options import Option

if TYPE_CHECKING:
    from concurrent.futures import Executor


@dataclass(frozen=True, kw_only=True)
class Processes:
    """Where parallel work is done.

    Attributes:
        workers: number of parallel processes. Default: one per core.
        cluster: address of a Dask scheduler whose workers do the work, such as tcp://host:8786, instead of processes of
            this machine.
    """

    alternatives: ClassVar[tuple[tuple[str, str], ...]] = (("workers", "cluster"),)

    workers: Annotated[int | None, Option(least=1)] = None
    cluster: Annotated[str | None, Option(shown="ADDRESS")] = None

    @contextmanager
    def executor(self) -> Iterator[Executor | None]:
        """Connects to the cluster; None without one, for processes of this machine.

        Raises:
            InputError: see `robots.common.clusters.cluster`.
        """
        if self.cluster is None:
            yield None
            return
        from robots.common.clusters import cluster

        with cluster(self.cluster) as executor:
            yield executor
