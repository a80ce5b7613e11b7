"""A quick fit, joint by joint, that shows whether the torque follows from the motion at all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from estimation.gate.excerpts import Excerpt
from robots.regressor import TorqueModel
from robots.robot import Robot
from robots.terms import RigidBody

Array = NDArray[np.float64]

# Added to the diagonal of the Gram matrix once its columns have unit length; the data choose.
RIDGES = (1e-8, 1e-6, 1e-5, 1e-4, 1e-3)
# Of a joint by itself: enough to tell directions apart that the joint alone hardly sees.
OWN_RIDGE = 1e-6
# Stretches of time that are left out in turn, and blocks whose residuals count as independent.
FOLDS, BLOCKS = 6, 60
# sign(dq) is smoothed over this share of a joint's RMS speed.
SHARP = 0.05
# Columns that each joint has of its own, after those of the rigid body.
OWN = 4  # rotor inertia, Coulomb, viscous, offset
# Weights of the joints are set so many times from the residuals.
ROUNDS = 3


@dataclass(frozen=True, eq=False)
class Moments:
    """Normal equations of each joint and of each fold.

    Attributes:
        gram: (F, n, p, p).
        cross: (F, n, p).
        square: (F, n), of the torque.
        count: (F,) rows.
        scale: (p,) by which the columns were divided.
    """

    gram: Array
    cross: Array
    square: Array
    count: Array
    scale: Array

    def scaled(self, factor: Array) -> Moments:
        """As if the torques (n,) were so many times what was logged."""
        return Moments(self.gram, self.cross * factor[:, None], self.square * factor**2, self.count, self.scale)


@dataclass(frozen=True, eq=False)
class WholeFit:
    """The fit of all joints at once.

    Attributes:
        values: (p,), of the scaled columns.
        inverse: of the weighted Gram matrix with its ridge (p, p).
        weights: of the joints (n,).
        unexplained: error on left-out stretches over the standard deviation of the torque (n,).
        cost: mean over the joints of the log of the residual's variance.
    """

    values: Array
    inverse: Array
    weights: Array
    unexplained: Array
    cost: float


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
        """A sum of parameters: its value and its standard error, which coloured residuals do not fool.

        Args:
            weights: (k,) of the parameters of the unscaled columns.
        """
        direction = weights / self.scale
        value = float(direction @ self.values)
        blocks = len(self.scores)
        influence = self.scores @ (self.inverse @ direction)
        return value, float(np.sqrt(influence @ influence * blocks / max(blocks - 1, 1)))


@lru_cache(maxsize=8)
def rigid_body(robot: Robot) -> TorqueModel:
    """The rigid body of a robot, kept: its expression takes longer than the check of a short log."""
    return TorqueModel(robot, (RigidBody(),))


def regressor(robot: Robot, q: Array, dq: Array, ddq: Array) -> Array:
    """Y (M, n, p) of the rigid body."""
    # numpy rather than compiled code: the rows are few, and a compiler would take seconds.
    return rigid_body(robot).regressor(q, dq, ddq, backend="vectorised")


@dataclass(frozen=True, eq=False)
class Rows:
    """All excerpts, one after the other.

    Attributes:
        excerpts: the stretches.
        q: (M, n).
        dq: (M, n).
        ddq: (M, n).
        Y: (M, n, p) of the rigid body.
        block: (M,) which of the blocks a row belongs to.
        speed: RMS speed of each joint (n,).
    """

    excerpts: tuple[Excerpt, ...]
    q: Array
    dq: Array
    ddq: Array
    Y: Array
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
        Y = regressor(robot, q, dq, ddq)
        return Rows(tuple(excerpts), q, dq, ddq, Y, block, np.sqrt(np.mean(dq**2, axis=0)))

    def raw(self, joint: int) -> Array:
        """Torque of a joint (M,), counted from 0, as it was logged."""
        return np.concatenate([part.raw[:, joint] for part in self.excerpts if part.raw is not None])

    def torques(self, shift: float = 0.0, order: int = 0) -> Array:
        """Torques (M, n) as they are logged so much later [s], or their derivatives of some order."""
        return np.concatenate([_evaluate(part, part.t + shift, order) for part in self.excerpts])

    @cached_property
    def _torques(self) -> Array:
        return self.torques()

    def torque(self, joint: int) -> Array:
        """Torque of a joint (M,), counted from 0."""
        return np.ascontiguousarray(self._torques[:, joint])

    def columns(self, joint: int) -> tuple[Array, NDArray[np.intp]]:
        """Regressor of a joint (M, k) with its own columns, to be read only, and which of the rigid body's they are."""
        if joint not in self._columns:
            self._columns[joint] = self._joined(joint)
        return self._columns[joint]

    @cached_property
    def _columns(self) -> dict[int, tuple[Array, NDArray[np.intp]]]:
        return {}

    def _joined(self, joint: int) -> tuple[Array, NDArray[np.intp]]:
        # Rotor inertia, Coulomb, viscous, offset.
        body = self.Y[:, joint]
        used = np.flatnonzero(np.any(body != 0.0, axis=0))
        dq = self.dq[:, joint]
        sign = np.tanh(dq / max(SHARP * self.speed[joint], 1e-12))
        own = np.column_stack([self.ddq[:, joint], sign, dq, np.ones(len(dq))])
        return np.column_stack([body[:, used], own]), used

    def fit(self, joint: int) -> JointFit:
        """Fits one joint, counted from 0, by itself: what is wrong with another joint does not touch it."""
        Y, used = self.columns(joint)
        tau = self.torque(joint)
        scale = _scale(Y)
        Y = Y / scale
        gram = Y.T @ Y
        values = _solve(gram, Y.T @ tau, OWN_RIDGE)
        residual = tau - Y @ values
        scores = np.add.reduceat(Y * residual[:, None], self.starts, axis=0)
        return JointFit(Y, scale, used, values, _solve(gram, np.eye(len(gram)), OWN_RIDGE), residual, scores)

    @property
    def starts(self) -> NDArray[np.intp]:
        """The first row of each block."""
        return np.flatnonzero(np.diff(self.block, prepend=-1))

    def moments(self, joints: NDArray[np.intp], *, raw: bool = False) -> Moments:
        """Sums the normal equations of some joints, fold by fold, with smoothed torques or raw ones."""
        n, p = len(self.speed), self.Y.shape[2] + OWN * len(self.speed)
        bounds = np.linspace(0, len(self.q), FOLDS + 1).astype(int)
        gram, cross, square = np.zeros((FOLDS, n, p, p)), np.zeros((FOLDS, n, p)), np.zeros((FOLDS, n))
        for joint in map(int, joints):
            Y, used = self.columns(joint)
            where = np.concatenate([used, self.Y.shape[2] + OWN * joint + np.arange(OWN)])
            tau = self.raw(joint) if raw else self.torque(joint)
            for k, (first, stop) in enumerate(pairwise(bounds)):
                part = Y[first:stop]
                gram[k, joint][np.ix_(where, where)] = part.T @ part
                cross[k, joint, where] = part.T @ tau[first:stop]
                square[k, joint] = float(tau[first:stop] @ tau[first:stop])
        scale = np.sqrt(np.einsum("kjpp->p", gram) / len(self.q))
        scale = np.where(scale > 0, scale, 1.0)
        return Moments(gram / scale[:, None] / scale, cross / scale, square, np.diff(bounds).astype(float), scale)


def fit_all(moments: Moments, spread: Array) -> WholeFit:
    """Fits all joints at once, each weighted by its residual, with the ridge that predicts left-out stretches best.

    Args:
        moments: of the joints.
        spread: standard deviation of the torques (n,).
    """
    gram, cross, square = (array.sum(axis=0) for array in (moments.gram, moments.cross, moments.square))
    rows = moments.count.sum()
    floor = 1e-12 * square / rows + np.finfo(float).tiny
    used = spread > 0
    weights = np.where(used, 1.0 / np.where(used, spread, 1.0) ** 2, 0.0)
    for _ in range(ROUNDS):
        values = _solve(np.tensordot(weights, gram, 1), weights @ cross, RIDGES[1])
        variance = np.maximum(_squares(gram, cross, square, values) / rows, floor)
        weights = np.where(used, 1.0 / variance, 0.0)
    best = np.full(len(spread), np.inf)
    ridge, lowest = RIDGES[0], np.inf
    for candidate in RIDGES:
        error = np.zeros(len(spread))
        for k in range(FOLDS):
            others = _solve(
                np.tensordot(weights, gram - moments.gram[k], 1), weights @ (cross - moments.cross[k]), candidate
            )
            error += _squares(moments.gram[k], moments.cross[k], moments.square[k], others)
        relative = np.sqrt(error / rows) / np.where(used, spread, np.inf)
        cost = float(np.mean(np.log(np.clip(relative[used], 1e-9, 1.0)))) if used.any() else 0.0
        if cost < lowest - 1e-3:
            lowest, ridge, best = cost, candidate, relative
    total = np.tensordot(weights, gram, 1)
    values = _solve(total, weights @ cross, ridge)
    variance = np.maximum(_squares(gram, cross, square, values) / rows, floor)
    cost = float(np.mean(np.log(variance[used]))) if used.any() else 0.0
    return WholeFit(values, _solve(total, np.eye(len(total)), ridge), weights, np.where(used, best, np.nan), cost)


def _squares(gram: Array, cross: Array, square: Array, values: Array) -> Array:
    """Sum of squared residuals of each joint (n,)."""
    return np.asarray(np.maximum(square - 2 * cross @ values + (gram @ values) @ values, 0.0))


def _scale(Y: Array) -> Array:
    scale = np.sqrt(np.mean(Y**2, axis=0))
    return np.where(scale > 0, scale, 1.0)


def _evaluate(part: Excerpt, t: Array, order: int = 0) -> Array:
    assert part.torque is not None
    return np.asarray(part.torque(np.clip(t, part.torque.x[0], part.torque.x[-1]), order))


def _solve(gram: Array, cross: Array, ridge: float) -> Array:
    scale = np.sqrt(np.diag(gram))
    scale = np.where(scale > 0, scale, 1.0)
    scaled, right = gram / scale[:, None] / scale, cross / scale.reshape((-1,) + (1,) * (cross.ndim - 1))
    try:
        solved = cho_solve(cho_factor(scaled + ridge * np.eye(len(gram))), right)
    except LinAlgError:
        # Values that differ by twelve orders of magnitude: rounding has made the matrix indefinite.
        solved = np.linalg.lstsq(scaled + ridge * np.eye(len(gram)), right, rcond=1e-9)[0]
    return np.asarray(solved / scale.reshape((-1,) + (1,) * (cross.ndim - 1)))
