"""The quick fit of each joint alone: whether its torque follows from the motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimation.gate.quick_fits.excerpts import Excerpt
from estimation.gate.quick_fits.joint_columns import OWN, JointColumns, joined, under_gravity
from estimation.gate.quick_fits.rigid_body import joint_rows, rigid_body, used_columns
from estimation.linear_algebra.scaled import solve_ridge
from estimation.regressions.blocks import Blocks
from estimation.uncertainty.blocks import block_numbers, correlated_errors
from robots.common.arrays import Array
from robots.robot import Robot

Places = NDArray[np.intp]

# Ridge of the fit of a single joint: its motion excites some combinations of parameters hardly.
OWN_RIDGE = 1e-6
# Folds of the cross-validation, and blocks of rows with independent residuals. Both are contiguous in time.
FOLDS, BLOCKS = 6, 60


@dataclass(frozen=True, eq=False)
class JointFit:
    """The fit of one joint.

    Attributes:
        Y: regressor of the counted rows (M', k), scaled.
        scale: of its columns (k,).
        used: parameters of the rigid body that the first columns belong to.
        values: parameters of the scaled columns (k,).
        inverse: inverse of the Gram matrix with its ridge (k, k).
        residual: of the counted rows (M',).
        scores: Y' residual of each block (B, k).
        counted: rows (M,) in which the joint moves.
    """

    Y: Array
    scale: Array
    used: NDArray[np.intp]
    values: Array
    inverse: Array
    residual: Array
    scores: Array
    counted: NDArray[np.bool_]

    def combination(self, weights: Array) -> tuple[float, float]:
        """Gives the value of a linear combination of parameters, and its standard error under correlated residuals.

        Args:
            weights: of the parameters of the unscaled columns (k,).
        """
        direction = weights / self.scale
        value = float(direction @ self.values)
        return value, float(correlated_errors(self.scores @ (self.inverse @ direction)))


@dataclass(frozen=True, eq=False)
class Rows:
    """All excerpts, one after the other, with the regressor.

    Attributes:
        excerpts: the excerpts.
        q: positions (M, n) [rad or m].
        dq: velocities (M, n).
        ddq: accelerations (M, n).
        joints: regressor of each joint (n).
        bodies: number of the rigid body's parameters.
        block: number of each row's block (M,).
        speed: RMS speed of each joint (n,).
        rest: rows (M, n) that count in no fit of a joint, for it stands.
    """

    excerpts: tuple[Excerpt, ...]
    q: Array
    dq: Array
    ddq: Array
    joints: tuple[JointColumns, ...]
    bodies: int
    block: NDArray[np.intp]
    speed: Array
    rest: NDArray[np.bool_]

    @staticmethod
    def of(
        robot: Robot,
        excerpts: Sequence[Excerpt],
        most: int | None = None,
        gravity: Array | None = None,
        static: bool = False,
    ) -> Rows:
        """Evaluates the regressor on all excerpts.

        Args:
            robot: with n joints.
            excerpts: of its log.
            most: number of rows to which they are thinned; None for all.
            gravity: (3,) in the base frame [m/s2]; None as the robot's description says.
            static: without the torques of velocities and accelerations: gravity, friction and offset are left.
        """
        if most is not None:
            stride = max(1, sum(len(part.t) for part in excerpts) // most)
            excerpts = [part.thinned(stride) for part in excerpts]
        q, dq, ddq = (np.concatenate([getattr(part, name) for part in excerpts]) for name in ("q", "dq", "ddq"))
        rows = len(q)
        block = block_numbers(rows, BLOCKS)
        speed = np.sqrt(np.mean(dq**2, axis=0))
        rest = np.concatenate([part.rest for part in excerpts])
        own = np.zeros_like(ddq) if static else ddq
        bodies, used = joint_rows(robot, q, np.zeros_like(dq) if static else dq, own), used_columns(robot)
        if gravity is not None:
            bodies, used = under_gravity(robot, q, bodies, used, gravity)
        joints = tuple(
            joined(body, columns, dq[:, j], own[:, j], float(speed[j]))
            for j, (body, columns) in enumerate(zip(bodies, used, strict=True))
        )
        return Rows(tuple(excerpts), q, dq, ddq, joints, rigid_body(robot).size, block, speed, rest)

    def raw(self, joint: int) -> Array:
        """Gives the torque of a joint (M,), counted from 0, as it was logged."""
        return np.concatenate([part.raw[:, joint] for part in self.excerpts if part.raw is not None])

    def torques(self, shift: float = 0.0, order: int = 0) -> Array:
        """Gives the smoothed torques (M, n) that are logged later by a shift [s], or their derivatives."""
        return np.concatenate([part.torque_at(part.t + shift if shift else part.t, order) for part in self.excerpts])

    def near_torques(self, shifts: Array, joint: int, stride: int) -> Array:
        """Gives the torque of a joint at several shifts, linear between samples, on the thinned rows.

        Args:
            shifts: by which it is logged later (S,) [s].
            joint: counted from 0.
            stride: between the rows that are kept of each excerpt.

        Returns:
            (S, M').
        """
        return np.concatenate([part.torque_near(shifts, joint, stride) for part in self.excerpts], axis=1)

    @cached_property
    def _torques(self) -> Array:
        return self.torques()

    def torque(self, joint: int) -> Array:
        """Gives the smoothed torque of a joint (M,), counted from 0."""
        return np.ascontiguousarray(self._torques[:, joint])

    def thinned(self, stride: int) -> NDArray[np.intp]:
        """Gives the rows that remain if one of `stride` is kept of each excerpt."""
        ends = np.cumsum([len(part.t) for part in self.excerpts])
        starts = np.concatenate([[0], ends[:-1]])
        return np.concatenate([np.arange(start, end, stride) for start, end in zip(starts, ends, strict=True)])

    def spread(self, joint: int, *, raw: bool = False) -> float:
        """Gives the standard deviation of a joint's torque, as it was logged or smoothed, while the joint moves."""
        return float((self.raw(joint) if raw else self.torque(joint))[~self.rest[:, joint]].std())

    def fit(self, joint: int) -> JointFit:
        """Fits one joint alone, counted from 0: a fault of another joint has no effect on it."""
        own, counted = self.joints[joint], ~self.rest[:, joint]
        Y, tau = own.Y[counted], self.torque(joint)[counted]
        gram = Y.T @ Y
        values = solve_ridge(gram, Y.T @ tau, OWN_RIDGE)
        residual = tau - Y @ values
        scores = self.block_sums(Y * residual[:, None], counted)
        inverse = solve_ridge(gram, np.eye(len(gram)), OWN_RIDGE)
        return JointFit(Y, own.scale, own.used, values, inverse, residual, scores, counted)

    def block_sums(self, values: Array, counted: NDArray[np.bool_]) -> Array:
        """Sums values (M', ...) of the counted rows over each block (B, ...)."""
        return np.add.reduceat(values, np.flatnonzero(np.diff(self.block[counted], prepend=-1)), axis=0)

    def moments(self, joints: NDArray[np.intp], *, raw: bool = False) -> Blocks:
        """Sums the normal equations of some joints, counted from 0, fold by fold.

        Args:
            joints: some.
            raw: of the torques as logged, not of smoothed ones.
        """
        chosen = tuple(map(int, joints))
        gram, scale, places = self._gram(chosen)
        n, folds, p = gram.shape[:3]
        cross, square, count = np.zeros((n, folds, p)), np.zeros((n, folds)), np.zeros((n, folds))
        for joint in chosen:
            own, tau = self.joints[joint], self.raw(joint) if raw else self.torque(joint)
            acts, place = places[joint]
            factor = own.scale[acts] / scale[place]
            for k, rows in enumerate(self._folds(joint)):
                cross[joint, k, place] = factor * (own.Y[rows].T @ tau[rows])[acts]
                square[joint, k] = float(tau[rows] @ tau[rows])
                count[joint, k] = len(tau[rows])
        return Blocks(gram, cross, square, count)

    def _gram(self, joints: tuple[int, ...]) -> tuple[Array, Array, dict[int, tuple[Places, Places]]]:
        """Sums the Gram matrices of the columns that are not zero, scaled to unit mean square over these joints.

        They do not depend on the torques. The last result is kept.

        Returns:
            The matrices (n, F, p, p), the RMS of the unscaled columns (p,), and for each joint the columns that are not
            zero, with their places among the p.
        """
        if joints not in self._grams:
            energy = np.zeros(self.bodies + OWN * len(self.speed))
            parts = {}
            for joint in joints:
                own = self.joints[joint]
                parts[joint] = np.array([own.Y[rows].T @ own.Y[rows] for rows in self._folds(joint)])
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

    def _folds(self, joint: int) -> list[slice | NDArray[np.intp]]:
        """Gives the counted rows of each fold."""
        bounds = np.linspace(0, len(self.q), FOLDS + 1).astype(int).tolist()
        if not self.rest[:, joint].any():
            return [slice(first, stop) for first, stop in pairwise(bounds)]
        return [first + np.flatnonzero(~self.rest[first:stop, joint]) for first, stop in pairwise(bounds)]

    def _place(self, joint: int) -> NDArray[np.intp]:
        """Gives the places of a joint's columns among those of all joints."""
        return np.concatenate([self.joints[joint].used, self.bodies + OWN * joint + np.arange(OWN)])
