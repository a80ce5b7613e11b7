"""What runs on a cluster's workers: a task, and its link to the client."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Any

from robots.common.errors import InputError, OedError
from robots.common.parallel import mark_as_worker
from robots.version import VERSION

_stopped: set[str] = set()
_limits: list[Any] = []
_lock = threading.Lock()


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


def stop_tasks(name: str) -> None:
    """Lets `Link.stopped` of that name be true in this process."""
    _stopped.add(name)


def work(call: bytes, version: str) -> Any:
    """Does one task, in a worker."""
    import cloudpickle
    from threadpoolctl import threadpool_limits

    if version != VERSION:
        raise OedError(f"a worker of the cluster has robot-oed {VERSION}", allowed=version)
    with _lock:
        # For good, and not around the task: another task may run beside it in a thread of its own.
        if not _limits:
            _limits.append(threadpool_limits(limits=1, user_api="blas"))
            mark_as_worker()
    try:
        function, args, kwargs = cloudpickle.loads(call)
    except ImportError as error:
        raise OedError(
            f"a worker of the cluster cannot import {error.name}",
            remedy="start the workers in the folder of the script, or put that on their PYTHONPATH",
        ) from error
    return function(*args, **kwargs)


def missing(where: str) -> InputError:
    """The error of a machine without robot-oed."""
    return InputError(f"{where} has no robot-oed", remedy="install the same version of it there")
