"""All that an estimator may look at: motion, torque and regressor, a chunk at a time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add
from typing import NamedTuple, Protocol

from estimation.preprocessing.base import Smoother
from estimation.regressions.moments import Moments
from robots.base_parameters import BaseParameters
from robots.common.arrays import Array
from robots.common.stretches import chunks
from robots.robot import Robot
from robots.signals import Log, Motion


class FittedRows(Protocol):
    """Data of one log for a fit: smoothed motion, torque (N, n) [N m or N] and the rows that count (N, n)."""

    @property
    def motion(self) -> Motion:
        """The smoothed motion of N samples."""

    @property
    def tau(self) -> Array:
        """Measured torque (N, n)."""

    @property
    def mask(self) -> Array:
        """Zero where a row of a joint does not count (N, n)."""

    @property
    def gravity(self) -> Array | None:
        """Gravity in the base frame (3,) [m/s2]; None as the robot's description says."""


class Chunk(NamedTuple):
    """Some rows of one log: Y (m, n, b), tau (m, n), mask (m, n)."""

    Y: Array
    tau: Array
    mask: Array


@dataclass(frozen=True, kw_only=True)
class RegressionData:
    """The data of a fit.

    Attributes:
        base: base parameters of the model that is fitted.
        moments: normal equations of all parts.
        parts: one per log, in the order of the logs.
        ridge: that the data chose, see `Moments.solve`.
        logs: as they were recorded, one per part; empty where they are not at hand.
        smoother: what made the motion of the recorded positions; None where it is not known.
    """

    base: BaseParameters
    moments: Moments
    parts: Sequence[FittedRows]
    ridge: float = 0.0
    logs: Sequence[Log] = ()
    smoother: Smoother | None = None

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self.base.model.robot

    def chunks(self) -> Iterator[Chunk]:
        """Goes through the rows of all parts, in order, without ever holding the whole regressor."""
        for part in self.parts:
            yield from self.chunks_of(part)

    def chunks_of(self, part: FittedRows) -> Iterator[Chunk]:
        """Goes through the rows of one part."""
        motion = part.motion
        for rows in chunks(len(motion)):
            Y = self.base.regressor(motion.q[rows], motion.dq[rows], motion.ddq[rows], gravity=part.gravity)
            yield Chunk(Y, part.tau[rows], part.mask[rows])

    def blocks(self, count: int) -> list[Moments]:
        """Sums normal equations over some `count` contiguous pieces of the parts, to be predicted from each other."""
        rows = sum(len(part.motion) for part in self.parts)
        blocks = []
        for part in self.parts:
            pieces = max(1, round(count * len(part.motion) / rows))
            size = -(-len(part.motion) // pieces)
            for start in range(0, len(part.motion), size):
                piece = _Piece(part, slice(start, start + size))
                blocks.append(reduce(add, (Moments.of(*chunk) for chunk in self.chunks_of(piece))))
        return blocks


class _Piece:
    """Some rows of a part."""

    def __init__(self, part: FittedRows, rows: slice) -> None:
        self.motion = part.motion.slice(rows.start, rows.stop)
        self.tau, self.mask, self.gravity = part.tau[rows], part.mask[rows], part.gravity
