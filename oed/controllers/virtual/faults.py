"""What the network does to datagrams: it loses, doubles, delays and reorders them."""

from __future__ import annotations

import random

from oed.controllers.virtual.options import Faults

OVERTAKEN = 0.005
"""A reordered datagram is held back for so long [s], so that the next one overtakes it."""


class Network:
    """Decides for each datagram when it arrives.

    Args:
        faults: what goes wrong.
    """

    def __init__(self, faults: Faults) -> None:
        self._faults = faults
        self._random = random.Random(faults.seed)

    def arrivals(self, now: float) -> list[float]:
        """Gives the times at which a datagram that is sent now arrives: none, one or two [s]."""
        faults, draw = self._faults, self._random.random
        if not faults.of_datagrams:
            return [now]
        if draw() < faults.lose:
            return []
        copies = 2 if draw() < faults.double else 1
        times = []
        for _ in range(copies):
            late = faults.late_by if draw() < faults.late else 0.0
            times.append(now + late + (OVERTAKEN if draw() < faults.reorder else 0.0))
        return times
