"""Logs whose clocks each began anew, put on one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from robots.common.errors import InputError
from robots.signals import Log

PAUSE = 60.0
"""Pause [s] taken between two logs where nobody noted it."""


def on_one_clock(logs: Sequence[Log], pause: float = PAUSE) -> list[Log]:
    """Puts logs that each began at a time of their own one after the other, in the order given.

    What depends on the time between logs, such as heat, is then known as well as the pause is.

    Args:
        logs: in the order in which they were recorded.
        pause: between the end of one and the start of the next [s].

    Returns:
        The logs, the first as it was.

    Raises:
        InputError: a pause of nothing or less.
    """
    if not pause > 0.0:
        raise InputError(f"a pause of {pause} s between logs", allowed="more than 0")
    result: list[Log] = []
    for log in logs:
        start = float(result[-1].t[-1]) + pause if result else float(log.t[0])
        result.append(replace(log, t=log.t - log.t[0] + start))
    return result
