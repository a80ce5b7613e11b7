"""What a robot does with the path that it is given, where something is wrong with it."""

from __future__ import annotations

import numpy as np

from oed.controllers.virtual_options import PathKind
from robots.common.arrays import Array


class PathFault:
    """Changes what the robot does from a time of the trajectory on; it goes on from where it is.

    Args:
        kind: ``swap`` exchanges the first joint and the last, ``sign`` turns the first one round, ``half-speed`` plays
            at half of the speed, ``stall`` stands still for 5 s, ``offset`` shifts the first joint by 0.2, and
            ``other-robot`` has other gears and a coupling between neighbours.
        after: so long after the start of the trajectory [s].
    """

    def __init__(self, kind: PathKind, after: float) -> None:
        self._kind, self._after = kind, after
        self.begin()

    def begin(self) -> None:
        """Begins a trajectory."""
        self._ticks = 0
        self._from: Array | None = None

    def holds(self, elapsed: float) -> bool:
        """Whether the robot stays where it is at a time since the start [s]."""
        if elapsed < self._after:
            return False
        if self._kind == "stall":
            # How long a robot stands still in the middle [s].
            return elapsed < self._after + 5.0
        self._ticks += 1
        return self._kind == "half-speed" and self._ticks % 2 == 0

    def moved(self, q: Array, elapsed: float) -> Array:
        """Gives where the robot is (n,) that should be at q (n,) at a time since the start [s]."""
        if self._kind not in ("swap", "sign", "offset", "other-robot") or elapsed < self._after:
            return q
        if self._from is None:
            self._from = q
        n, away = len(q), q - self._from
        if self._kind == "swap":
            away[[0, -1]] = away[[-1, 0]]
        elif self._kind == "sign":
            away[0] = -away[0]
        elif self._kind == "offset":
            # By how much an encoder jumps [rad or m].
            away[0] += 0.2
        else:
            away = away @ (0.6 * np.eye(n) + 0.3 * np.eye(n, k=1))
        return self._from + away
