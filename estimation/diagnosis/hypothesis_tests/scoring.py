"""Score of a group: what it explains beyond the base model and the groups already accepted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from estimation.diagnosis.calibration import MIN_VISIBLE_ENERGY
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Group, Problem
from robots.common.arrays import Array
from robots.robot import Robot


@dataclass(frozen=True, eq=False)
class Accepted:
    """Groups that are already part of the model, with orthonormal columns beside the base model.

    Attributes:
        groups: the groups, with a columns together.
        root: L^-1 with L L' their joint Gram matrix (a, a); makes their columns orthonormal.
        cross: products of the orthonormal columns with the residual (a,).
    """

    groups: tuple[Group, ...]
    root: Array
    cross: Array

    @property
    def gain(self) -> float:
        """Chi-square that the groups explain together."""
        return float(self.cross @ self.cross)

    def torque(self, white: Array) -> Array:
        """Returns the groups' whitened torque (N, n), fitted by least squares.

        Args:
            white: array of the result's shape (N, n).
        """
        total, coefficients = np.zeros_like(white), self.root.T @ self.cross
        for group in self.groups:
            own, coefficients = coefficients[: group.size], coefficients[group.size :]
            for j, part in zip(group.joints, group.columns, strict=True):
                total[:, j] += part @ own
        return total


def accept(problem: Problem, groups: tuple[Group, ...]) -> Accepted:
    """Combines groups into one set of orthonormal columns."""
    if not groups:
        return Accepted((), np.zeros((0, 0)), np.zeros(0))
    gram = np.block([[problem.product(a, b) for b in groups] for a in groups])
    raw = np.concatenate([group.raw for group in groups])
    root = visible_root(gram, raw)
    cross = np.concatenate([group.cross for group in groups])
    return Accepted(groups, root, root @ cross)


@dataclass(frozen=True, eq=False)
class Limited:
    """Fit of a group within what is physically possible.

    Attributes:
        gain: chi-square explained.
        coefficients: (k,).
        degrees: number of visible directions in which they may vary.
    """

    gain: float
    coefficients: Array
    degrees: int


@dataclass(frozen=True, eq=False)
class Score:
    """Regression of a group on the residual, with base model and accepted groups projected out.

    Attributes:
        gram: Gram matrix of the columns (k, k).
        cross: products with the residual (k,).
        raw: squared norms before any projection (k,).
        root: (k', k), makes the visible directions orthonormal.
        onto: products of the accepted orthonormal columns with the group's (a, k).
    """

    gram: Array
    cross: Array
    raw: Array
    root: Array
    onto: Array

    @property
    def degrees(self) -> int:
        """Number of visible directions k'."""
        return len(self.root)

    @property
    def gain(self) -> float:
        """Chi-square explained with unbounded coefficients."""
        return float(np.sum((self.root @ self.cross) ** 2))

    @property
    def visible(self) -> float:
        """Largest share of a column's energy that the base model and the accepted groups do not absorb."""
        return float(np.max(np.diag(self.gram) / np.maximum(self.raw, 1e-300), initial=0.0))

    def coefficients(self) -> Array:
        """Returns the least-squares coefficients (k,) in the visible directions."""
        return np.asarray(self.root.T @ (self.root @ self.cross))

    def bounded(self, lower: Array, upper: Array) -> tuple[float, Array]:
        """Returns chi-square explained and coefficients (k,) within their bounds (k,)."""
        c = self.coefficients()
        if not self.degrees:
            return 0.0, c
        if np.all((c >= lower) & (c <= upper)):
            return self.gain, c
        if len(c) == 1:  # fast path: most of the thousands of columns in a scan
            c = np.asarray(np.clip(c, lower, upper))
        else:
            matrix, target = self._least_squares()
            c = np.asarray(lsq_linear(matrix, target, bounds=(lower, upper), method="bvls").x)
        return self._explained(c), c

    def limited(self, hypothesis: Hypothesis, robot: Robot, shape: tuple[float, ...]) -> Limited:
        """Fits the coefficients of a hypothesis within what is physically possible.

        Args:
            hypothesis: effect and joint of the group.
            robot: the robot.
            shape: values of its shape parameters.
        """
        effect, degrees = hypothesis.effect, self.degrees
        c = effect.nearest(*self._least_squares(), shape) if degrees and effect.constrained else None
        if c is None:
            gain, c = self.bounded(*hypothesis.coefficient_bounds(robot, shape))
            return Limited(gain, c, degrees)
        tangent = effect.tangent(c, shape)
        return Limited(self._explained(c), c, degrees if tangent is None else min(degrees, tangent.shape[1]))

    def _least_squares(self) -> tuple[Array, Array]:
        """Returns A (r, k) and y (r,): the best coefficients minimise |A c - y|^2, and A'A is their Gram matrix."""
        matrix = 1.0 / self.root if len(self.raw) == 1 else np.asarray(np.linalg.pinv(self.root.T))
        return matrix, self.root @ self.cross

    def _explained(self, coefficients: Array) -> float:
        matrix, target = self._least_squares()
        return max(float(target @ target - np.sum((matrix @ coefficients - target) ** 2)), 0.0)


def score(problem: Problem, group: Group, accepted: Accepted) -> Score:
    """Projects the accepted groups out of a group and returns its score."""
    if not accepted.groups:
        onto = np.zeros((0, group.size))
    else:
        onto = accepted.root @ np.concatenate([problem.product(other, group) for other in accepted.groups])
    gram = group.gram - onto.T @ onto
    cross = group.cross - onto.T @ accepted.cross
    return Score(gram, cross, group.raw, visible_root(gram, group.raw), onto)


def visible_root(gram: Array, raw: Array) -> Array:
    """Returns R (k', k) with R gram R' = I on the visible directions.

    A direction is visible if the projections leave at least `MIN_VISIBLE_ENERGY` of its energy.

    Args:
        gram: Gram matrix after the projections (k, k).
        raw: squared norms before them (k,).
    """
    if len(raw) == 1:
        return gram**-0.5 if gram[0, 0] > MIN_VISIBLE_ENERGY * max(raw[0], 1e-300) else np.zeros((0, 1))
    scale = np.sqrt(np.maximum(raw, 1e-300))
    values, vectors = np.linalg.eigh(gram / scale[:, None] / scale)
    kept = values > MIN_VISIBLE_ENERGY
    return np.asarray((vectors[:, kept] / np.sqrt(values[kept])).T / scale)
