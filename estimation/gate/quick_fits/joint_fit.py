"""A quick fit, joint by joint, that shows whether the torque follows from the motion at all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimation.gate.quick_fits.excerpts import Excerpt
from estimation.gate.quick_fits.rigid_body import joint_rows, rigid_body, used_columns
from estimation.gate.quick_fits.whole_fit import Moments, solve_scaled
from robots.robot import Robot

Array = NDArray[np.float64]
Places = NDArray[np.intp]

# Ridge of the fit of a single joint, for directions that the joint hardly shows.
OWN_RIDGE = 1e-6
# Stretches of time that are left out in turn, and blocks whose residuals count as independent.
FOLDS, BLOCKS = 6, 60
# sign(dq) is smoothed over this share of a joint's RMS speed.
SHARP = 0.05
# Of a joint's largest column: what is smaller is the rounding of a product that is zero.
SILENT = 1e-12
# Columns that each joint has of its own, after those of the rigid body.
OWN = 4  # rotor inertia, Coulomb, viscous, offset


@dataclass(frozen=True, eq=False)
class JointColumns:
    """The columns of one joint: of the rigid body, then its own.

    Attributes:
        Y: (M, k), scaled to unit mean square.
        scale: (k,) by which they were divided.
        used: indices of the rigid body's columns among its parameters.
    """

    Y: Array
    scale: Array
    used: NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class JointFit:
    """The fit of one joint.

    Attributes:
        Y: (M, k), columns that act on the joint, scaled to unit mean square.
        scale: (k,) of the columns.
        used: indices (k,) of the rigid body's columns, then of the joint's own.
        values: (k,), of the scaled columns.
        inverse: of the Gram matrix with its ridge (k, k).
        residual: (M,).
        scores: (B, k), Y' residual of each block.
    """

    Y: Array
    scale: Array
    used: NDArray[np.intp]
    values: Array
    inverse: Array
    residual: Array
    scores: Array

    def combination(self, weights: Array) -> tuple[float, float]:
        """A sum of parameters: its value and its standard error, which allows for correlated residuals.

        Args:
            weights: (k,) of the parameters of the unscaled columns.
        """
        direction = weights / self.scale
        value = float(direction @ self.values)
        blocks = len(self.scores)
        influence = self.scores @ (self.inverse @ direction)
        return value, float(np.sqrt(influence @ influence * blocks / max(blocks - 1, 1)))


@dataclass(frozen=True, eq=False)
class Rows:
    """All excerpts, one after the other.

    Attributes:
        excerpts: the stretches.
        q: (M, n).
        dq: (M, n).
        ddq: (M, n).
        joints: the columns of each joint (n).
        bodies: number of the rigid body's parameters.
        block: (M,) which of the blocks a row belongs to.
        speed: RMS speed of each joint (n,).
    """

    excerpts: tuple[Excerpt, ...]
    q: Array
    dq: Array
    ddq: Array
    joints: tuple[JointColumns, ...]
    bodies: int
    block: NDArray[np.intp]
    speed: Array

    @staticmethod
    def of(robot: Robot, excerpts: Sequence[Excerpt], most: int | None = None) -> Rows:
        """Puts stretches together and evaluates the regressor, thinned to `most` rows where given."""
        if most is not None:
            stride = max(1, sum(len(part.t) for part in excerpts) // most)
            excerpts = [part.thinned(stride) for part in excerpts]
        q, dq, ddq = (np.concatenate([getattr(part, name) for part in excerpts]) for name in ("q", "dq", "ddq"))
        rows = len(q)
        block = np.minimum((np.arange(rows) * BLOCKS) // rows, BLOCKS - 1)
        speed = np.sqrt(np.mean(dq**2, axis=0))
        bodies, used = joint_rows(robot, q, dq, ddq), used_columns(robot)
        joints = tuple(
            _joined(body, columns, dq[:, j], ddq[:, j], float(speed[j]))
            for j, (body, columns) in enumerate(zip(bodies, used, strict=True))
        )
        return Rows(tuple(excerpts), q, dq, ddq, joints, rigid_body(robot).size, block, speed)

    def raw(self, joint: int) -> Array:
        """Torque of a joint (M,), counted from 0, as it was logged."""
        return np.concatenate([part.raw[:, joint] for part in self.excerpts if part.raw is not None])

    def torques(self, shift: float = 0.0, order: int = 0) -> Array:
        """Torques (M, n) as they are logged so much later [s], or their derivatives of some order."""
        return np.concatenate([part.torque_at(part.t + shift if shift else part.t, order) for part in self.excerpts])

    def near_torques(self, shifts: Array, joint: int, stride: int) -> Array:
        """Torque of a joint, counted from 0, so much later (S,) [s], on every so many rows of each stretch (S, M')."""
        return np.concatenate([part.torque_near(shifts, joint, stride) for part in self.excerpts], axis=1)

    @cached_property
    def _torques(self) -> Array:
        return self.torques()

    def torque(self, joint: int) -> Array:
        """Torque of a joint (M,), counted from 0."""
        return np.ascontiguousarray(self._torques[:, joint])

    def thinned(self, stride: int) -> NDArray[np.intp]:
        """The rows that remain of every so many of each stretch."""
        ends = np.cumsum([len(part.t) for part in self.excerpts])
        starts = np.concatenate([[0], ends[:-1]])
        return np.concatenate([np.arange(start, end, stride) for start, end in zip(starts, ends, strict=True)])

    def fit(self, joint: int) -> JointFit:
        """Fits one joint, counted from 0, by itself: what is wrong with another joint does not touch it."""
        own = self.joints[joint]
        Y, tau = own.Y, self.torque(joint)
        gram = Y.T @ Y
        values = solve_scaled(gram, Y.T @ tau, OWN_RIDGE)
        residual = tau - Y @ values
        scores = np.array([Y[rows].T @ residual[rows] for rows in self._blocks])
        inverse = solve_scaled(gram, np.eye(len(gram)), OWN_RIDGE)
        return JointFit(Y, own.scale, own.used, values, inverse, residual, scores)

    @property
    def starts(self) -> NDArray[np.intp]:
        """The first row of each block."""
        return np.flatnonzero(np.diff(self.block, prepend=-1))

    @property
    def _blocks(self) -> list[slice]:
        return [slice(first, stop) for first, stop in pairwise([*self.starts.tolist(), len(self.block)])]

    def moments(self, joints: NDArray[np.intp], *, raw: bool = False) -> Moments:
        """Sums the normal equations of some joints, fold by fold, with smoothed torques or raw ones."""
        chosen = tuple(map(int, joints))
        gram, scale, places = self._gram(chosen)
        n, folds, p = gram.shape[:3]
        cross, square = np.zeros((n, folds, p)), np.zeros((n, folds))
        for joint in chosen:
            own = self.joints[joint]
            tau = self.raw(joint) if raw else self.torque(joint)
            acts, place = places[joint]
            factor = own.scale[acts] / scale[place]
            for k, rows in enumerate(self._folds):
                cross[joint, k, place] = factor * (own.Y[rows].T @ tau[rows])[acts]
                square[joint, k] = float(tau[rows] @ tau[rows])
        return Moments(gram, cross, square, np.array([rows.stop - rows.start for rows in self._folds], dtype=float))

    def _gram(self, joints: tuple[int, ...]) -> tuple[Array, Array, dict[int, tuple[Places, Places]]]:
        """Gram matrices (n, F, p, p) of the columns that act at all, of unit mean square over these joints.

        They are the same for smoothed torques and raw ones, and kept for the latest joints asked for.

        Returns:
            The matrices, what the columns were divided by (p,), and of each joint which of its columns act and where
            they stand.
        """
        if joints not in self._grams:
            energy = np.zeros(self.bodies + OWN * len(self.speed))
            parts = {}
            for joint in joints:
                own = self.joints[joint]
                parts[joint] = np.array([own.Y[rows].T @ own.Y[rows] for rows in self._folds])
                energy[self._place(joint)] += own.scale**2 * sum(np.diag(part) for part in parts[joint])
            kept = np.flatnonzero(energy > 0)
            scale = np.sqrt(energy[kept] / len(self.q))
            gram = np.zeros((len(self.speed), FOLDS, len(kept), len(kept)))
            places = {}
            for joint in joints:
                at = self._place(joint)
                acts = np.flatnonzero(energy[at] > 0)
                places[joint] = acts, np.searchsorted(kept, at[acts])
                place = places[joint][1]
                factor = self.joints[joint].scale[acts] / scale[place]
                acting = parts[joint][:, acts[:, None], acts]
                gram[joint][:, place[:, None], place] = acting * factor[:, None] * factor
            self._grams.clear()
            self._grams[joints] = gram, scale, places
        return self._grams[joints]

    @cached_property
    def _grams(self) -> dict[tuple[int, ...], tuple[Array, Array, dict[int, tuple[Places, Places]]]]:
        return {}

    @property
    def _folds(self) -> list[slice]:
        bounds = np.linspace(0, len(self.q), FOLDS + 1).astype(int).tolist()
        return [slice(first, stop) for first, stop in pairwise(bounds)]

    def _place(self, joint: int) -> NDArray[np.intp]:
        """Where a joint's columns stand among those of all joints."""
        return np.concatenate([self.joints[joint].used, self.bodies + OWN * joint + np.arange(OWN)])


def _joined(body: Array, used: NDArray[np.intp], dq: Array, ddq: Array, speed: float) -> JointColumns:
    """Sets rotor inertia, Coulomb and viscous friction and offset beside the rigid body's columns (M, k)."""
    Y = np.empty((len(body), body.shape[1] + OWN))
    Y[:, :-OWN] = body
    sign = np.tanh(dq / max(SHARP * speed, 1e-12))
    for column, values in enumerate((ddq, sign, dq, 1.0), start=body.shape[1]):
        Y[:, column] = values
    scale = np.sqrt(np.einsum("ik,ik->k", Y, Y) / len(Y))
    # A column that does not act is rounding: brought to unit size it would be a regressor of chance.
    silent = scale <= SILENT * scale.max()
    Y[:, silent], scale[silent] = 0.0, 1.0
    Y /= scale
    return JointColumns(Y, scale, used)
