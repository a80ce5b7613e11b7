"""Ctrl-C, the order to terminate and a lost terminal: all end a motion in one way, and none cuts the stop short."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

# Windows has no lost terminals.
ORDERS = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))
SIGNALS = (signal.SIGINT, *ORDERS)


@contextmanager
def signals_held() -> Iterator[None]:
    """Holds signals back while the robot is stopped and the log is closed; they count afterwards.

    Raises:
        KeyboardInterrupt: at the end, if one came.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came = False

    def note(*_: object) -> None:
        nonlocal came
        came = True

    with _handled(SIGNALS, note):
        yield
    if came:
        raise KeyboardInterrupt


@contextmanager
def terminate_as_interrupt() -> Iterator[None]:
    """Lets an order to terminate, or a lost terminal, raise KeyboardInterrupt, as Ctrl-C does."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    with _handled(ORDERS, interrupt):
        yield


@contextmanager
def _handled(numbers: Sequence[int], handler: Callable[..., None]) -> Iterator[None]:
    """Handles signals meanwhile, without those that the program was started to ignore, as by ``nohup``."""
    before = {number: signal.getsignal(number) for number in numbers}
    heard = {number: usual for number, usual in before.items() if usual not in (signal.SIG_IGN, None)}
    for number in heard:
        signal.signal(number, handler)
    try:
        yield
    finally:
        for number, usual in heard.items():
            signal.signal(number, usual)
