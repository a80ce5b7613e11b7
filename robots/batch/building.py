"""CasADi expressions are built by one thread at a time."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

Given = ParamSpec("Given")
Built = TypeVar("Built")

_LOCK = threading.RLock()


def builds_expressions(function: Callable[Given, Built]) -> Callable[Given, Built]:
    """Lets one thread at a time into functions that build CasADi expressions.

    Expressions share nodes, whose counts of references are not atomic: two threads that build at once end in a
    segmentation fault, rarely. Evaluators that are built need no lock.
    """

    @wraps(function)
    def alone(*args: Given.args, **kwargs: Given.kwargs) -> Built:
        with _LOCK:
            return function(*args, **kwargs)

    return alone


__all__ = ["builds_expressions"]
