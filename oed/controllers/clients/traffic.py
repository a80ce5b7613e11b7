"""What happened on the way to the controller."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf

import numpy as np


@dataclass
class Traffic:
    """What happened on the way.

    Attributes:
        begun: whether a point has left; a robot without any needs no stop.
        sent: points that were confirmed, or downloaded.
        resent: how often a point was sent again.
        unexpected: replies that were late, came twice, or were no messages.
        pings: round trips of pings [s].
        shortest: shortest round trip of a point [s]; a full buffer keeps replies back.
        stopped: whether a stop was confirmed.
    """

    begun: bool = False
    sent: int = 0
    resent: int = 0
    unexpected: int = 0
    pings: list[float] = field(default_factory=list)
    shortest: float = inf
    stopped: bool = False

    @property
    def delay(self) -> float | None:
        """Half the round trip of a message [s]: the median of pings, or the shortest of points; None without any."""
        if self.pings:
            return float(np.median(self.pings)) / 2
        return self.shortest / 2 if self.shortest < inf else None


@dataclass
class Request:
    """A point that waits for its reply.

    Attributes:
        data: its bytes.
        sent: when it was sent last [s].
        first: when it was sent first [s].
        tries: how often.
    """

    data: bytes
    sent: float
    first: float
    tries: int = 1
