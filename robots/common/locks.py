"""Locks of files: a program holds them to its end, also where it is killed."""

from __future__ import annotations

import importlib
import os
from contextlib import suppress

_held: set[int] = set()


def lock(number: int) -> None:
    """Locks an open file for this process.

    Args:
        number: of the file; `close_locked` closes it.

    Raises:
        OSError: another process has locked it, or its disk has no locks.
    """
    try:
        import fcntl
    except ImportError:  # Windows
        msvcrt = importlib.import_module("msvcrt")
        msvcrt.locking(number, msvcrt.LK_NBLCK, 1)
    else:
        fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
    _held.add(number)


def close_locked(number: int) -> None:
    """Closes a file, which ends its lock."""
    _held.discard(number)
    os.close(number)


def _leave_to_parent() -> None:
    # The lock lasts until the last copy of the file is closed: a worker may outlive a killed parent.
    for number in _held:
        with suppress(OSError):
            os.close(number)
    _held.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_leave_to_parent)
