"""Events: alarms that are being confirmed, and short forces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from estimation.monitoring.findings import Finding
from robots.common.records import Record


@dataclass
class Event(Record, as_list=True):
    """An alarm that is being confirmed.

    Attributes:
        time: end of the window with the alarm [s].
        log: number of the log, from 0.
        sources: indices of the quantities with an alarm.
        windows: seen since.
    """

    time: float
    log: int
    sources: list[int]
    windows: int = 0


def contact_finding(force: tuple[float, float, int, int, float], logs: Sequence[str]) -> Finding:
    """The finding of a short force.

    Args:
        force: start of its window [s], its time [s], number of the log from 0, highest joint that felt it (0 for
            none), and its chi-square.
        logs: names of the logs.
    """
    _, at, log, link, _ = force
    return Finding(
        kind="contact",
        joint=None,
        size=0.0,
        low=0.0,
        high=0.0,
        unit="",
        earliest=at - 0.5,
        latest=at + 0.5,
        detected=at,
        sigmas=0.0,
        log=logs[log],
        text=f" (felt in the torque of joint {link} and below)" if link else "",
    )
