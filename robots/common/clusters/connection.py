"""The connection to a Dask scheduler, and what it must have in common with this machine."""

from __future__ import annotations

import asyncio
import logging
import platform
import pydoc
import warnings
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

from robots.common.clusters.executor import ClusterExecutor
from robots.common.clusters.tasks import missing
from robots.common.errors import InputError

ANSWER_TIMEOUT = 5.0
"""A scheduler must answer within this time [s]."""

EVERYWHERE = ("robots.version.VERSION", "distributed.__version__")
"""What must be the same on the scheduler and on all workers."""

NUMERICS = ("numpy.__version__", "scipy.__version__", "casadi.__version__")
"""Where these differ between workers and this process, the last digits may."""


class ClusterWarning(UserWarning):
    """Results of a cluster's workers may differ from those of this machine in the last digits."""


@contextmanager
def cluster(address: str) -> Iterator[ClusterExecutor]:
    """Connects to a Dask scheduler and gives an executor whose work its workers do.

    Each task runs with one BLAS thread. The task of a lost worker is done again by another. All paths in tasks must
    mean the same files on all machines.

    Args:
        address: of the scheduler, such as ``tcp://192.168.1.10:8786``.

    Yields:
        The executor; on leaving, what has not begun is cancelled and the connection closed.

    Raises:
        InputError: the package `distributed` is missing, no scheduler answers, it has no workers, or robot-oed is
            missing or of another version on the scheduler or a worker.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise InputError(
            "a cluster needs the package distributed", remedy='pip install "robot-oed[cluster]"'
        ) from error
    with _quiet():
        try:
            # VersionMismatchWarning and the like: `_require_same_versions` says what matters.
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                _require_answer(address)
                client = Client(address, timeout=ANSWER_TIMEOUT, set_as_default=False)
        except Exception as error:
            raise InputError(
                f"no Dask scheduler answers at {address}",
                allowed="the address that `dask scheduler` prints, such as tcp://192.168.1.10:8786",
                remedy="check the address, and that the scheduler runs and this machine reaches it",
            ) from error
        try:
            _require_same_versions(client, address)
            executor = ClusterExecutor(client, address)
            try:
                yield executor
            finally:
                executor.shutdown(wait=False, cancel_futures=True)
        finally:
            client.close(timeout=ANSWER_TIMEOUT)


def _require_answer(address: str) -> None:
    """Shakes hands with a scheduler once: the client would wait for ever where something else listens.

    Raises:
        Exception: what went wrong.
    """
    from distributed import Security
    from distributed.comm import connect

    async def shake_hands() -> None:
        options = Security().get_connection_args("client")
        comm = await asyncio.wait_for(connect(address, timeout=ANSWER_TIMEOUT, **options), ANSWER_TIMEOUT)
        comm.abort()

    # In a thread: a notebook's own has a loop that runs already.
    with ThreadPoolExecutor(1) as apart:
        apart.submit(asyncio.run, shake_hands()).result()


def _require_same_versions(client: Any, address: str) -> None:
    """Refuses a cluster without workers, or with software of another version.

    Raises:
        InputError: see `cluster`.
    """

    def found(name: str) -> dict[str, Any]:
        # A function of Python's own: it can be sent to workers that lack robot-oed.
        return {
            "its scheduler": client.run_on_scheduler(pydoc.locate, name),
            **{f"its worker {at}": seen for at, seen in client.run(pydoc.locate, name).items()},
        }

    if not client.nthreads():
        raise InputError(f"the Dask scheduler at {address} has no workers", remedy=f"start some: dask worker {address}")
    for where, python in {
        "its scheduler": client.run_on_scheduler(platform.python_version),
        **client.run(platform.python_version),
    }.items():
        if python.split(".")[:2] != platform.python_version().split(".")[:2]:
            raise InputError(f"{where} has Python {python}", allowed=platform.python_version())
    for name in EVERYWHERE:
        here = pydoc.locate(name)
        for where, seen in found(name).items():
            if seen is None:
                raise missing(f"{address}: {where}")
            if seen != here:
                package = "robot-oed" if name.startswith("robots") else name.split(".")[0]
                raise InputError(
                    f"{address}: {where} has {package} {seen}", allowed=f"{here}, as here", remedy="install the same"
                )
    others = sorted(name.split(".")[0] for name in NUMERICS if set(found(name).values()) != {pydoc.locate(name)})
    if others:
        warnings.warn(
            f"the cluster has other versions of {', '.join(others)}: the last digits of results may differ",
            ClusterWarning,
            stacklevel=3,
        )


@contextmanager
def _quiet() -> Iterator[None]:
    """Keeps Dask's own log off the terminal: what matters comes as an error of ours."""
    logger = logging.getLogger("distributed")
    before = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        logger.setLevel(before)
