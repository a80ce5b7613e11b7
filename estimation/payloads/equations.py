"""Linear equations of a payload and of the arm that carries it, from one log or from two.

With the arm's parameters b = b0 + d, what a log's torque has beyond b0 is ``tau - Y b0 = Y d + Z p``: Y are the arm's
columns, and Z the ten columns of a body on its mount, which are zero in a log without the payload.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.payloads.mounts import Mount
from estimation.payloads.paths import PathMatch
from estimation.regressions.preparation import Rows
from estimation.uncertainty import Played
from robots.common.arrays import Array
from robots.common.stretches import chunks
from robots.geometry.inertia import BODY_PARAMETERS
from robots.regressor import TorqueModel
from robots.signals import Motion
from robots.terms.situations.sensitivities import moved_body


@dataclass(frozen=True, eq=False)
class Arm:
    """What is known of the arm without the payload.

    Attributes:
        model: the torque model.
        columns: indices (b,) of its columns that carry a parameter.
        values: the parameters b0 (b,).
        precision: of what is known of them without the logs (b, b), see `weight`.
        target: what that knowledge says of d (b,).
        mount: what carries the payload.
        weight: by which the knowledge counts against rows whose noise is correlated: rows count as if they were
            independent, and carry that many times less information.
    """

    model: TorqueModel
    columns: tuple[int, ...]
    values: Array
    precision: Array
    target: Array
    weight: float
    mount: Mount

    @property
    def size(self) -> int:
        """The number of unknowns: the arm's and the payload's."""
        return len(self.columns) + BODY_PARAMETERS

    def torque(self, motion: Motion, gravity: Array | None) -> Array:
        """Evaluates the torque of b0 (N, n) [N m or N]."""
        model = self.model.under(gravity)
        return model.torque(motion.q, motion.dq, motion.ddq, self.values, columns=self.columns)

    def regressor(self, motion: Motion, at: slice | NDArray[np.intp], gravity: Array | None, carries: bool) -> Array:
        """Evaluates [Y, Z] (m, n, b + 10) of some rows; Z is zero without the payload."""
        model = self.model.under(gravity)
        state = motion.q[at], motion.dq[at], motion.ddq[at]
        if not carries:
            Y = model.regressor(*state, columns=self.columns)
            return np.concatenate([Y, np.zeros((*Y.shape[:2], BODY_PARAMETERS))], axis=2)
        Y = model.regressor(*state, columns=(*self.columns, *self.mount.columns(model)))
        Y[:, :, -BODY_PARAMETERS:] = Y[:, :, -BODY_PARAMETERS:] @ moved_body(self.mount.pose)
        return Y


@dataclass(frozen=True, eq=False)
class Source:
    """The rows of one log, whether they are with the payload, and the period of its motion [s]; None for none."""

    rows: Rows
    beyond: Array
    carries: bool
    period: float | None = None

    @staticmethod
    def of(arm: Arm, rows: Rows, carries: bool, extra: Array | None = None, period: float | None = None) -> Source:
        """Takes the arm's torque, and an extra torque (N, n), off the measured one."""
        beyond = rows.tau - arm.torque(rows.motion, rows.gravity)
        return Source(rows, beyond if extra is None else beyond - extra, carries, period)


class Equations:
    """Rows of one log, n channels."""

    def __init__(self, arm: Arm, source: Source) -> None:
        self.arm, self.source = arm, source
        self.target, self.mask = source.beyond, source.rows.mask
        motion = source.rows.motion
        self.played = Played(motion.t, motion.q, source.period, source.rows.gravity, source.carries)

    @property
    def rows(self) -> int:
        """The number of rows N."""
        return len(self.target)

    def regressor(self, start: int, stop: int) -> Array:
        """Evaluates the columns of some rows (stop - start, c, b + 10)."""
        rows = self.source.rows
        return self.arm.regressor(rows.motion, slice(start, stop), rows.gravity, self.source.carries)

    def chunks(self) -> Iterator[slice]:
        """Cuts the rows into pieces."""
        return chunks(self.rows)


class PairedEquations(Equations):
    """Rows of two logs of one path: n channels of their differences, n of their sums, both over the root of two.

    What the model misses alike in both logs is in the sums alone. The differences show the payload, and of the arm
    only what the motions differ by.
    """

    def __init__(self, arm: Arm, loaded: Source, free: Source, match: PathMatch) -> None:
        self.arm, self.loaded, self.free = arm, loaded, free
        self.first, self.second = match.first, match.second
        self.target = _turned(loaded.beyond[self.first], free.beyond[self.second])
        both = loaded.rows.mask[self.first] * free.rows.mask[self.second]
        self.mask = np.concatenate([both, both], axis=1)
        motion = loaded.rows.motion
        self.played = Played(motion.t[self.first], motion.q[self.first], loaded.period, loaded.rows.gravity)

    def regressor(self, start: int, stop: int) -> Array:
        """Evaluates the columns of some rows (stop - start, 2 n, b + 10)."""
        own, other = (
            self.arm.regressor(source.rows.motion, places[start:stop], source.rows.gravity, source.carries)
            for source, places in ((self.loaded, self.first), (self.free, self.second))
        )
        return _turned(own, other)


def _turned(own: Array, other: Array) -> Array:
    """Joins differences and sums along the axis of the joints."""
    return np.concatenate([own - other, own + other], axis=1) / np.sqrt(2.0)
