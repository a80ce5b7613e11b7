"""What the network does to datagrams: it loses, doubles, delays and reorders them."""

from __future__ import annotations

import heapq
import math
import random
from collections.abc import Callable

from oed.controllers.virtual_options import Faults


class Network:
    """Decides for each datagram when it arrives, and delivers it then.

    Args:
        faults: what goes wrong.
    """

    def __init__(self, faults: Faults) -> None:
        self._faults = faults
        self._random = random.Random(faults.seed)
        self._delayed: list[tuple[float, int, Callable[[], None]]] = []
        self._count = 0

    @property
    def next(self) -> float:
        """When the next datagram arrives [s]; infinity for none."""
        return self._delayed[0][0] if self._delayed else math.inf

    def send(self, now: float, arrive: Callable[[], None]) -> None:
        """Lets a datagram travel; `arrive` is called at once, later, twice or never."""
        for due in self.arrivals(now):
            if due <= now:
                arrive()
            # Datagrams on their way, at most.
            elif len(self._delayed) < 100_000:
                self._count += 1
                heapq.heappush(self._delayed, (due, self._count, arrive))

    def deliver(self, now: float) -> None:
        """Delivers what arrives up to a time [s]."""
        while self._delayed and self._delayed[0][0] <= now:
            heapq.heappop(self._delayed)[2]()

    def clear(self) -> None:
        """Loses everything that is on its way."""
        self._delayed.clear()

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
            # A reordered datagram is held back for so long [s], so that the next one overtakes it.
            times.append(now + late + (0.005 if draw() < faults.reorder else 0.0))
        return times
