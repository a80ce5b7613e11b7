"""What happened on the way to the controller."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np


@dataclass
class Traffic:
    """What happened on the way.

    Attributes:
        sent: points that were confirmed, or downloaded.
        resent: how often a point was sent again.
        unexpected: replies that were late, came twice, or were no messages.
        pings: round trips of pings [s].
        stopped: whether a stop was confirmed.
    """

    sent: int = 0
    resent: int = 0
    unexpected: int = 0
    pings: list[float] = field(default_factory=list)
    stopped: bool = False

    @property
    def delay(self) -> float | None:
        """Half the median round trip of a ping [s]; None without pings."""
        return float(np.median(self.pings)) / 2 if self.pings else None


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
