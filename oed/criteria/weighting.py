"""How rows and columns of the regressor count, and what is known before the experiment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from robots.base_parameters import BaseParameters
from robots.common.arrays import Array
from robots.common.errors import InputError

SCALINGS = ("none", "nominal", "unit")


@dataclass(frozen=True, kw_only=True, eq=False)
class Weighting:
    """The information matrix M = C' (amount G + prior) C that a criterion judges, G the mean of Y'WY over samples.

    Attributes:
        rows: (n,) one over each joint's noise [1/(N m)]; None counts all joints alike.
        transform: (m,) or (m, m), C: the columns' scaling, or the directions in which a task needs to know; None for
            none.
        unit_columns: whether columns are then scaled to unit length, on the motion at hand.
        prior: (m, m) information that earlier experiments brought, with the same rows' weights; None for none.
        amount: how many independent samples the experiment will bring; counts beside a prior only.
        name: as reports spell it.
    """

    rows: Array | None = None
    transform: Array | None = None
    unit_columns: bool = False
    prior: Array | None = None
    amount: float = 1.0
    name: str = "none"

    @property
    def plain(self) -> bool:
        """Whether M is just G."""
        return self.rows is None and self.transform is None and not self.unit_columns and self.prior is None

    def apply(self, gram: Array) -> Array:
        """Turns G (m, m) into M."""
        matrix = self._linear(gram)
        if not self.unit_columns:
            return matrix
        length = _lengths(matrix)
        return matrix / length[:, None] / length

    def pullback(self, weights: Array, gram: Array) -> Array:
        """Turns dL/dM (m, m, symmetric) into dL/dG at G."""
        if self.unit_columns:
            matrix = self._linear(gram)
            length = _lengths(matrix)
            unit = matrix / length[:, None] / length
            weights = weights / length[:, None] / length - np.diag((weights * unit).sum(axis=1) / length**2)
        if self.transform is not None:
            scale = self.transform
            weights = weights * scale[:, None] * scale if scale.ndim == 1 else scale @ weights @ scale.T
        return weights * self.amount if self.prior is not None else weights

    def singular_values(self, triangle: Array, samples: int) -> Array:
        """Computes the square roots of M's eigenvalues (m,), ascending.

        Args:
            triangle: R of a QR of the row-weighted regressor (m, m): R'R = Y'WY.
            samples: over how many samples R'R sums.
        """
        stacked = triangle
        if self.prior is not None:
            values, vectors = np.linalg.eigh(self.prior)
            root = (vectors * np.sqrt(np.maximum(values, 0.0))).T
            stacked = np.vstack([triangle * np.sqrt(self.amount / samples), root])
        if self.transform is not None:
            stacked = stacked * self.transform if self.transform.ndim == 1 else stacked @ self.transform
        if self.unit_columns:
            length = np.linalg.norm(stacked, axis=0)
            stacked = stacked / np.where(length > 0, length, 1.0)
        return np.asarray(np.linalg.svd(stacked, compute_uv=False)[::-1], dtype=np.float64)

    def _linear(self, gram: Array) -> Array:
        matrix = gram if self.prior is None else self.amount * gram + self.prior
        if self.transform is None:
            return matrix
        scale = self.transform
        return matrix * scale[:, None] * scale if scale.ndim == 1 else scale.T @ matrix @ scale


@dataclass(frozen=True, kw_only=True, eq=False)
class Prior:
    """Information from an earlier identification.

    Attributes:
        names: of its parameters (p,).
        covariance: of their values (p, p), infinite on the diagonal where one is not determined.
        noise: residual level of each joint (n,) [N m or N].
        colour: by how much coloured noise widened its standard errors: that many squared samples bring as much as one
            independent sample.
    """

    names: tuple[str, ...]
    covariance: Array
    noise: Array
    colour: float = 1.0

    def information(self, names: tuple[str, ...]) -> Array:
        """Gives the information (m, m) on the parameters of these names; zero on those it does not know.

        Raises:
            InputError: it knows none of them.
        """
        known = np.isfinite(np.diag(self.covariance))
        place = {name: i for i, name in enumerate(self.names) if known[i]}
        shared = [(j, place[name]) for j, name in enumerate(names) if name in place]
        if not shared:
            raise InputError(
                "the earlier model (--after) has no parameter in common with the design",
                remedy="use a model of the same robot",
            )
        ours, theirs = (list(side) for side in zip(*shared, strict=True))
        block = self.covariance[np.ix_(theirs, theirs)]
        scale = np.sqrt(np.diag(block))
        values, vectors = np.linalg.eigh(block / scale[:, None] / scale)
        inverse = (vectors / np.maximum(values, 1e-12)) @ vectors.T / scale[:, None] / scale
        information = np.zeros((len(names), len(names)))
        information[np.ix_(ours, ours)] = inverse
        return information


def _lengths(matrix: Array) -> Array:
    diagonal = np.diag(matrix)
    return np.sqrt(np.where(diagonal > 0, diagonal, 1.0))


def nominal_scale(base: BaseParameters) -> Array:
    """Gives the size (m,) that each base parameter has in the robot's description: columns times it are torques.

    Raises:
        InputError: the description lacks nominal parameters.
    """
    nominal = base.model.require_description("nominal scaling (--scaling none and unit do not)")
    size = np.abs(base.from_standard(nominal))
    kinds = [(column.unit, column.term) for column in base.columns]
    largest = {kind: max(s for s, k in zip(size, kinds, strict=True) if k == kind) for kind in set(kinds)}
    # A nominal value below this share of the largest one of its unit says nothing about the size to expect.
    floor = np.array([0.01 * largest[kind] if largest[kind] > 0 else 1.0 for kind in kinds])
    return np.maximum(size, floor)


def task_transform(base: BaseParameters, q: ArrayLike, dq: ArrayLike, ddq: ArrayLike) -> Array:
    """Gives the transform (m, m) that turns A-optimality into I-optimality for a task.

    trace((C'GC)^-1) = trace(T G^-1), the summed variance of the predicted torque on the task, with T = mean Y'Y of the
    task's motion (N, n each).
    """
    Y = base.regressor(q, dq, ddq)
    rows = Y.reshape(-1, base.size)
    task = rows.T @ rows / len(Y)
    # Directions that the task never uses need not be known; a trace of them keeps the transform finite.
    values, vectors = np.linalg.eigh(task)
    floored = np.maximum(values, 1e-8 * values[-1])
    return vectors / np.sqrt(floored)
