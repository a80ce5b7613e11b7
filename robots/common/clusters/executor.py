"""A cluster's workers as an executor of ``concurrent.futures``."""

from __future__ import annotations

import threading
import uuid
from collections.abc import Callable
from concurrent.futures import CancelledError, Executor, Future
from typing import Any

from robots.common.clusters.tasks import Link, missing, stop_tasks, work
from robots.common.errors import OedError
from robots.version import VERSION

WORKERLESS_TIMEOUT = 60.0
"""Work ends with an error when a cluster has had no worker for this time [s]."""

WORKER_CHECK_PERIOD = 1.0
"""Time between two looks at the cluster [s]."""


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
        inner = self._inner.submit(work, cloudpickle.dumps((fn, args, kwargs)), VERSION)
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
        self._client.run(stop_tasks, link.name, on_error="ignore")

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
            return missing(f"a worker of {self._address}")
        return error

    def _lost(self, problem: str) -> OedError:
        return OedError(problem, remedy="run the command again; finished robots, cases and rows are kept")

    def _watch(self) -> None:
        """Fails what waits when the cluster has had no worker for long."""
        without = 0.0
        while not self._over.wait(WORKER_CHECK_PERIOD):
            try:
                any_worker = bool(self._client.nthreads())
            except Exception:  # the connection is lost: Dask cancels what waits
                continue
            without = 0.0 if any_worker or not self._waiting else without + WORKER_CHECK_PERIOD
            if without >= WORKERLESS_TIMEOUT:
                problem = f"the Dask scheduler at {self._address} has had no worker for {without:.0f} s"
                for future in list(self._waiting):
                    if future.set_running_or_notify_cancel():
                        future.set_exception(self._lost(problem))
