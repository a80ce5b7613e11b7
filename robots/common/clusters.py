"""Workers of a Dask cluster as an executor of ``concurrent.futures``."""

from __future__ import annotations

import asyncio
import logging
import platform
import pydoc
import threading
import uuid
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from robots.common.errors import InputError, OedError
from robots.version import VERSION

ANSWER = 5.0
"""A scheduler must answer within this time [s]."""

WITHOUT_WORKERS = 60.0
"""Work ends with an error when a cluster has had no worker for this time [s]."""

LOOK = 1.0
"""Time between two looks at the cluster [s]."""

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
                client = Client(address, timeout=ANSWER, set_as_default=False)
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
            client.close(timeout=ANSWER)


class ClusterExecutor(Executor):
    """Hands tasks to a cluster's workers.

    Functions and arguments must pickle; those of a script's main module do, too. The scheduler gives the task of a
    lost worker to another; a task that has lost several workers fails.

    Args:
        client: of Dask.
        address: of the scheduler, for messages.
    """

    def __init__(self, client: Any, address: str) -> None:
        self._client, self._address = client, address
        self._inner = client.get_executor(pure=False)
        self._waiting: set[Future[Any]] = set()
        self._over = threading.Event()
        threading.Thread(target=self._watch, name="oed-cluster", daemon=True).start()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Hands one call to the cluster.

        Raises:
            RuntimeError: after `shutdown`.
        """
        import cloudpickle

        if self._over.is_set():
            raise RuntimeError("the cluster's executor is shut down")
        # As bytes: the scheduler then need not import what only workers do, and errors of pickle come to light here.
        inner = self._inner.submit(_work, cloudpickle.dumps((fn, args, kwargs)), VERSION)
        outer: Future[Any] = Future()
        self._waiting.add(outer)
        outer.add_done_callback(lambda _: self._forget(outer, inner))
        inner.add_done_callback(lambda _: self._deliver(inner, outer))
        return outer

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Ends the work; what runs on a worker ends there without being waited for if ``wait`` is false."""
        self._over.set()
        if cancel_futures:
            for future in list(self._waiting):
                future.cancel()
        self._inner.shutdown(wait=wait)

    def link(self, hear: Callable[[Any], None]) -> Link:
        """Opens a way for messages from running tasks.

        Args:
            hear: called with each message, in a thread of the client.
        """
        link = Link(f"oed-{uuid.uuid4().hex}")
        self._client.subscribe_topic(link.name, lambda event: hear(event[1]))
        return link

    def stop(self, link: Link) -> None:
        """Lets `Link.stopped` be true in all tasks that have the link."""
        self._client.run(_stop, link.name, on_error="ignore")

    def _forget(self, outer: Future[Any], inner: Future[Any]) -> None:
        self._waiting.discard(outer)
        if outer.cancelled():
            inner.cancel()

    def _deliver(self, inner: Future[Any], outer: Future[Any]) -> None:
        if outer.done() or not outer.set_running_or_notify_cancel():
            return
        try:
            outer.set_result(inner.result())
        except CancelledError:
            outer.set_exception(self._lost(f"the connection to the Dask scheduler at {self._address} was lost"))
        except Exception as error:
            outer.set_exception(self._ours(error))

    def _ours(self, error: Exception) -> Exception:
        """Says in our words what Dask says of a task; errors of the task itself pass as they are."""
        if type(error).__name__ == "KilledWorker":
            return OedError(
                "several workers of the cluster died with the same task",
                remedy="memory may have run out: start fewer workers on a machine, and read their logs",
            )
        if isinstance(error, ImportError) and error.name and error.name.split(".")[0] == "robots":
            return _missing(f"a worker of {self._address}")
        return error

    def _lost(self, problem: str) -> OedError:
        return OedError(problem, remedy="run the command again; finished robots, cases and rows are kept")

    def _watch(self) -> None:
        """Fails what waits when the cluster has had no worker for long."""
        without = 0.0
        while not self._over.wait(LOOK):
            try:
                any_worker = bool(self._client.nthreads())
            except Exception:  # the connection is lost: Dask cancels what waits
                continue
            without = 0.0 if any_worker or not self._waiting else without + LOOK
            if without >= WITHOUT_WORKERS:
                problem = f"the Dask scheduler at {self._address} has had no worker for {without:.0f} s"
                for future in list(self._waiting):
                    if future.set_running_or_notify_cancel():
                        future.set_exception(self._lost(problem))


@dataclass(frozen=True)
class Link:
    """Between a task on a worker and the client.

    Attributes:
        name: of this link alone.
    """

    name: str

    def tell(self, message: Any) -> None:
        """Sends a message (numbers, texts and lists of them) from within a task."""
        from distributed import get_worker

        get_worker().log_event(self.name, message)

    @property
    def stopped(self) -> bool:
        """Whether the client asks the task to end with what it has."""
        return self.name in _stopped


_stopped: set[str] = set()
_limits: list[Any] = []
_lock = threading.Lock()


def _stop(name: str) -> None:
    _stopped.add(name)


def _work(call: bytes, version: str) -> Any:
    """Does one task, in a worker."""
    import cloudpickle
    from threadpoolctl import threadpool_limits

    if version != VERSION:
        raise OedError(f"a worker of the cluster has robot-oed {VERSION}", allowed=version)
    with _lock:
        # For good, and not around the task: another task may run beside it in a thread of its own.
        if not _limits:
            _limits.append(threadpool_limits(limits=1, user_api="blas"))
    try:
        function, args, kwargs = cloudpickle.loads(call)
    except ImportError as error:
        raise OedError(
            f"a worker of the cluster cannot import {error.name}",
            remedy="start the workers in the folder of the script, or put that on their PYTHONPATH",
        ) from error
    return function(*args, **kwargs)


def _require_answer(address: str) -> None:
    """Shakes hands with a scheduler once: the client would wait for ever where something else listens.

    Raises:
        Exception: what went wrong.
    """
    from distributed import Security
    from distributed.comm import connect

    async def shake_hands() -> None:
        options = Security().get_connection_args("client")
        comm = await asyncio.wait_for(connect(address, timeout=ANSWER, **options), ANSWER)
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
                raise _missing(f"{address}: {where}")
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


def _missing(where: str) -> InputError:
    return InputError(f"{where} has no robot-oed", remedy="install the same version of it there")


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
