"""Memory that is no longer needed."""

from __future__ import annotations

import ctypes
import sys


def give_back() -> None:
    """Returns freed memory to the system, which glibc would keep.

    Memory that threads free in pieces stays in their arenas: after a search, half of the process's memory.
    """
    if not sys.platform.startswith("linux"):
        return
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)


__all__ = ["give_back"]
