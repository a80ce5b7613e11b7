"""How a worker process begins and ends, with its parent and by any signal; and memory that is no longer needed."""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
import sys
import threading
from multiprocessing.connection import wait

SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")


def start_worker() -> None:
    """Prepares a worker process for interrupts, and for the end of its parent."""
    # A terminal interrupts the whole process group: workers then end at once, without a traceback each. A forked worker
    # has the handlers of its parent, which would let it go on.
    for name in SIGNALS:
        if hasattr(signal, name) and signal.getsignal(getattr(signal, name)) != signal.SIG_IGN:
            signal.signal(getattr(signal, name), signal.SIG_DFL)
    end_with_parent()


def end_with_parent() -> None:
    """Ends this worker process as soon as its parent has ended, also where that was killed.

    Without this the workers of a killed program would wait for work for ever: each holds the others' queue open.
    """
    parent = multiprocessing.parent_process()
    if parent is None:
        return

    def watch() -> None:
        wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, name="parent", daemon=True).start()


def give_back() -> None:
    """Returns freed memory to the system, which glibc would keep.

    Memory that threads free in pieces stays in their arenas: after a search, half of the process's memory.
    """
    if not sys.platform.startswith("linux"):
        return
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
