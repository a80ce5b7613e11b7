"""The controller's buffer: points by their number, played in order."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from oed.exports.simple_message import FullPoint, Point, Valid, WireFormat, shortest
from robots.common.arrays import Array


class Outcome(Enum):
    """What became of a point."""

    ACCEPTED = "accepted"
    KNOWN = "known"
    FULL = "full"
    GAP = "gap"
    BACKWARD = "backward"


@dataclass(frozen=True, slots=True)
class Stored:
    """A point in the buffer.

    Attributes:
        time: since the start of the trajectory [s].
        q: positions (n,).
        dq: velocities (n,); None where the message has none.
        ddq: accelerations (n,); None where the message has none.
        rest: whether the robot may stay here.
    """

    time: float
    q: Array
    dq: Array | None
    ddq: Array | None
    rest: bool


class PointBuffer:
    """Holds points until they have been played.

    Args:
        n: number of joints.
        capacity: points that it holds.
        form: of the messages: times in reals of 4 bytes are read as the decimals that they stand for.
        ordered: whether a point that skips others is refused; otherwise the gap may be filled later.
    """

    def __init__(self, n: int, capacity: int, form: WireFormat, ordered: bool) -> None:
        self._n = n
        self._capacity = capacity
        self._short = form.real_bytes == 4
        self._ordered = ordered
        self._early: dict[int, FullPoint | Point] = {}
        self.clear()

    def clear(self) -> None:
        """Forgets everything."""
        self._early.clear()
        self.points: list[Stored] = []
        self.first = 0
        """Number of the first point in the list."""
        self.played = 0
        """Number of the first point that was not played yet."""

    @property
    def end(self) -> int:
        """Number of the first point that is missing."""
        return self.first + len(self.points)

    @property
    def full(self) -> bool:
        """Whether no further point is accepted."""
        return self.end - self.played >= self._capacity

    def accept(self, number: int, point: FullPoint | Point) -> Outcome:
        """Stores a point."""
        if number < self.end or number in self._early:
            return Outcome.KNOWN
        if number >= self.played + self._capacity:
            return Outcome.FULL
        if number > self.end and self._ordered:
            return Outcome.GAP
        self._early[number] = point
        while self.end in self._early:
            stored = self._stored(self._early.pop(self.end))
            if self.points and not stored.time > self.points[-1].time:
                return Outcome.BACKWARD
            self.points.append(stored)
        return Outcome.ACCEPTED

    def pass_time(self, time: float) -> None:
        """Marks what is not after a time [s] as played; two played points stay, for the interpolation."""
        while self.played < self.end and self.points[self.played - self.first].time <= time + 1e-9:
            self.played += 1
        surplus = self.played - self.first - 2
        if surplus > 0:
            del self.points[:surplus]
            self.first += surplus

    @property
    def at_rest(self) -> bool:
        """Whether the last point is one at which the robot may stay."""
        return self.points[-1].rest

    def sample(self, times: Array) -> tuple[Array, Array, Array]:
        """Interpolates positions, velocities and accelerations (m, n) at times (m,) within the stored points.

        Samples at points are the points; between them positions are cubic.
        """
        t = np.array([p.time for p in self.points])
        q = np.array([p.q for p in self.points])
        dq = _given([p.dq for p in self.points], q, t)
        ddq = _given([p.ddq for p in self.points], dq, t)
        times = np.clip(times, t[0], t[-1])
        near = np.clip(np.searchsorted(t, times - 1e-6), 0, len(t) - 1)
        hit = np.abs(t[near] - times) < 1e-6
        if len(t) < 2 or hit.all():
            return q[near], dq[near], ddq[near]
        right = np.clip(np.searchsorted(t, times), 1, len(t) - 1)
        left = right - 1
        h = (t[right] - t[left])[:, None]
        s = (times - t[left])[:, None] / h
        a, b, va, vb = q[left], q[right], h * dq[left], h * dq[right]
        c2, c3 = 3 * (b - a) - 2 * va - vb, 2 * (a - b) + va + vb
        between = (a + s * (va + s * (c2 + s * c3)), (va + s * (2 * c2 + 3 * s * c3)) / h, (2 * c2 + 6 * s * c3) / h**2)
        rows = hit[:, None]
        return (
            np.where(rows, q[near], between[0]),
            np.where(rows, dq[near], between[1]),
            np.where(rows, ddq[near], between[2]),
        )

    def _stored(self, point: FullPoint | Point) -> Stored:
        n = self._n
        q = np.array(point.positions[:n])
        # Speed, share of a speed, or step below which a point is one to stay at.
        rest = 1e-6
        if isinstance(point, Point):
            before = self.points[-1].time if self.points else 0.0
            duration = shortest(point.duration) if self._short else point.duration
            return Stored(before + duration if self.points else 0.0, q, None, None, point.velocity < rest)
        dq = np.array(point.velocities[:n]) if Valid.VELOCITY in point.valid else None
        ddq = np.array(point.accelerations[:n]) if Valid.ACCELERATION in point.valid else None
        time = shortest(point.time) if self._short else point.time
        if dq is not None:
            return Stored(time, q, dq, ddq, bool(np.abs(dq).max() < rest))
        last = self.points[-1].q if self.points else q
        return Stored(time, q, dq, ddq, bool(np.abs(q - last).max() < rest))


def _given(values: list[Array | None], integral: Array, t: Array) -> Array:
    if all(value is not None for value in values):
        return np.array(values)
    return np.gradient(integral, t, axis=0) if len(t) > 1 else np.zeros_like(integral)
