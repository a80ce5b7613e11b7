"""The physically consistent fit: every link a body that can exist, every loss a loss."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from estimation.estimators.base import Solution
from estimation.estimators.wls import WeightedLeastSquares
from estimation.linear_algebra.conic import ConicProgram
from estimation.linear_algebra.log_determinant import add_log_determinant
from estimation.regressions.default_prior import joint_scatter
from estimation.regressions.moments import Moments
from estimation.regressions.regression_data import RegressionData
from estimation.regressions.standard_parameters import (
    Scaling,
    body_columns,
    box_rows,
    column_levels,
    largest_speed,
    nonnegative_rows,
    scaling,
)
from robots.collision.drawn.link_boxes import link_boxes
from robots.common.arrays import Array
from robots.common.errors import InputError, SolverError
from robots.consistency import BASIS, normalised_eigenvalues

# Smallest eigenvalue of a pseudo-inertia, in units in which the reference body's trace is 2.
LEAST_BODY_EIGENVALUE = 1e-5
# Weights of the prior, in units of the data's whole misfit; chosen by cross-validation.
PULLS = (1e-5, 1e-4, 1e-3, 1e-2)


@dataclass(frozen=True)
class _Problem:
    """Constraints and prior in scaled units; the data come with each solve."""

    grouping: Array  # (b, p), scaled
    scaling: Scaling
    target: Array  # scaled, of the description
    precision: Array  # (p,) of what belongs to joints: friction, rotors, offsets; zero for bodies
    rows: Array
    entropic: bool

    def solve(self, moments: Moments, weights: Array, level: float, pull: float, ridge: float) -> Array:
        """Solves for scaled standard parameters (p,)."""
        size, bodies = self.grouping.shape[1], self.scaling.bodies
        links = len(bodies) if self.entropic else 0
        program = ConicProgram(size + 14 * links)
        gram = np.tensordot(weights, moments.gram, axes=1)
        quadratic = np.zeros((program.size, program.size))
        quadratic[:size, :size] = self.grouping.T @ gram @ self.grouping / level
        linear = np.zeros(program.size)
        linear[:size] = -self.grouping.T @ (weights @ moments.cross) / level
        # What the description says of friction, rotors and offsets counts as it does in any other fit.
        strength = ridge * float(weights @ moments.square) / level * self.precision
        quadratic[range(size), range(size)] += strength
        linear[:size] -= strength * self.target
        # Keeps parameters that the data do not touch where they are; far below what data say of any other.
        faint = 1e-9
        quadratic[range(size), range(size)] += faint
        linear[bodies] -= faint * self.scaling.unit_reference
        for link, columns in enumerate(bodies):
            basis = np.zeros((program.size, 4, 4))
            basis[columns] = BASIS
            program.semidefinite(basis, -LEAST_BODY_EIGENVALUE * np.eye(4))
            reference = np.tensordot(self.scaling.unit_reference[link], BASIS, axes=1)
            inverse = np.linalg.inv(reference)
            if self.entropic:
                linear[columns] += pull * np.tensordot(BASIS, inverse, axes=2)
                add_log_determinant(program, linear, columns, size + 14 * link, pull)
            else:
                # The second-order expansion of the entropic distance about the reference: as free of frames and units.
                metric = np.einsum("aij,jk,bkl,li->ab", BASIS, inverse, BASIS, inverse)
                quadratic[np.ix_(columns, columns)] += pull * metric
                linear[columns] -= pull * metric @ self.scaling.unit_reference[link]
        rows = np.zeros((len(self.rows), program.size))
        rows[:, :size] = self.rows
        program.nonnegative(rows, np.zeros(len(rows)))
        return program.solve(quadratic, linear, "physically consistent fit")[:size]


class PhysicallyConsistent(WeightedLeastSquares):
    """min sum_j w_j ||tau_j - Y_j G pi||^2 / S + pull D(pi, pi_0) over standard parameters pi that can exist.

    Constraints: each link's pseudo-inertia is positive definite; its centre of mass lies in its box, where a box is
    known; rotor inertias, Coulomb and viscous friction are not negative, and friction brakes at every speed seen. D is
    the entropic (log det Bregman) distance to the robot's description, or its second-order, Euclidean form; links
    without a description are regularised towards a plausible body. S is the misfit of weighted least squares. The
    weight of the regularisation is the largest that predicts left-out blocks as well as the best (Wensing et al. 2018;
    Lee et al. 2020). The data enter as normal equations: a longer log costs no more.

    The solution's extras: ``standard`` (p,), ``pull``, ``eigenvalues`` (n, 4) of the normalised pseudo-inertias, and
    ``active``, the parameters and bodies at their bounds.

    Args:
        pull: ``entropic``, ``euclidean``, which are weighted by the data.
        weight: of the pull; None lets left-out blocks choose.
        boxes: link, counted from 1, to the lowest and highest corner (3,) of a box about it, in the link's frame [m];
            None takes those of the robot's URDF, where its shapes are primitive.
        temper: see `WeightedLeastSquares`.

    Raises:
        InputError: an unknown pull, a negative weight, or a box that is empty.
    """

    name = "consistent"

    def __init__(
        self,
        *,
        pull: str = "entropic",
        weight: float | None = None,
        boxes: Mapping[int, tuple[ArrayLike, ArrayLike]] | None = None,
        temper: float = 1.0,
    ) -> None:
        super().__init__(temper)
        if pull not in ("entropic", "euclidean"):
            raise InputError(f"pull {pull!r}", allowed="entropic, euclidean")
        if weight is not None and not (np.isfinite(weight) and weight > 0):
            raise InputError(f"a prior of weight {weight}", allowed="a positive number, or None")
        self.pull, self.weight = pull, weight
        self.boxes = None if boxes is None else {int(link): _box(link, corners) for link, corners in boxes.items()}

    def refine(self, data: RegressionData, values: Array, weights: Array) -> Solution:
        """Solves the semidefinite program, and checks what it gave by eigenvalues.

        Raises:
            InputError: a box about a link that the robot has not.
            InfeasibleError: constraints that no parameters obey.
            SolverError: the solver gave up, or its answer is no body.
        """
        model = data.base.model
        units = scaling(data)
        rows = nonnegative_rows(model, largest_speed(data))
        if len(units.bodies):
            rows = np.vstack([rows, box_rows(model, self._boxes(data, units))])
        rows = rows * units.scale
        lengths = np.linalg.norm(rows, axis=1, keepdims=True)
        spread = np.concatenate([part.tau for part in data.parts]).std(axis=0)
        scatter = joint_scatter(model, spread, column_levels(data.base, data.moments))
        problem = _Problem(
            grouping=data.base.grouping * units.scale,
            scaling=units,
            target=np.nan_to_num(model.nominal) / units.scale,
            precision=np.divide(units.scale, scatter, out=np.zeros(model.size), where=scatter > 0) ** 2,
            rows=rows / np.where(lengths > 0, lengths, 1.0),
            entropic=self.pull == "entropic",
        )
        chosen = self._weight(problem, data, weights) if self.weight is None else self.weight
        level = _level(data.moments, weights, data.ridge)
        standard = problem.solve(data.moments, weights, level, chosen, data.ridge) * units.scale
        eigenvalues = normalised_eigenvalues(standard[units.bodies]) if len(units.bodies) else np.zeros((0, 4))
        if not (eigenvalues > 0).all():
            link = int(np.argmin(eigenvalues.min(axis=1))) + 1
            raise SolverError(
                f"physically consistent fit: the parameters of link {link} are not those of a physical body",
                remedy="use a larger prior weight",
            )
        margins = problem.rows @ (standard / units.scale)
        # A value closer to its bound than this fraction of its scale counts as at the bound.
        close = 1e-4
        alone = (np.count_nonzero(rows, axis=1) == 1) & (margins < close)
        flat = np.flatnonzero((eigenvalues < close).any(axis=1)) + 1
        active = [model.names[k] for k in np.flatnonzero(rows[alone].any(axis=0))] + [f"body of link {k}" for k in flat]
        return Solution(
            values=data.base.from_standard(standard),
            weights=weights,
            extras={"standard": standard, "pull": chosen, "eigenvalues": eigenvalues, "active": tuple(active)},
        )

    def _boxes(self, data: RegressionData, units: Scaling) -> dict[int, tuple[Array, Array]]:
        robot = data.robot
        if self.boxes is not None:
            wrong = [link for link in self.boxes if not 1 <= link <= robot.n]
            if wrong:
                raise InputError(f"a box about link {wrong[0]}", allowed=f"links 1 to {robot.n}")
            return self.boxes
        boxes = {}
        for link, (lower, upper) in link_boxes(robot).items():
            # A description that contradicts its own shapes is not held against the data.
            centre = units.reference[link - 1, 1:4] / units.reference[link - 1, 0]
            known = units.described[link - 1]
            boxes[link] = (np.minimum(lower, centre), np.maximum(upper, centre)) if known else (lower, upper)
        return boxes

    def _weight(self, problem: _Problem, data: RegressionData, weights: Array) -> float:
        """The strongest prior whose held-out error is as good as the best."""
        blocks = data.blocks(4)
        if len(blocks) < 2:
            return PULLS[0]
        spread = np.maximum(data.moments.square, np.finfo(float).tiny)
        costs = []
        for pull in PULLS:
            error = sum(self._left_out(problem, data, blocks, index, weights, pull) for index in range(len(blocks)))
            costs.append(float(np.log(np.clip(error / spread, 1e-18, 1.0)).mean()) / 2)
        best = min(costs)
        # A stronger prior is used if its held-out error is at most this much worse (mean log).
        return max(pull for pull, cost in zip(PULLS, costs, strict=True) if cost <= best + 0.002)

    @staticmethod
    def _left_out(
        problem: _Problem, data: RegressionData, blocks: Sequence[Moments], index: int, weights: Array, pull: float
    ) -> Array:
        rest = data.moments - blocks[index]
        level = _level(rest, weights, data.ridge)
        standard = problem.solve(rest, weights, level, pull, data.ridge) * problem.scaling.scale
        return blocks[index].residual(data.base.from_standard(standard))


def standard_of(solution: Solution) -> Array | None:
    """Gives the standard parameters (p,) of a solution, None where its estimator finds base parameters alone."""
    return solution.extras.get("standard")


def _level(moments: Moments, weights: Array, ridge: float) -> float:
    """The weighted misfit of least squares, floored at a per cent of the torque: an exact fit still keeps a prior."""
    values = moments.solve(weights, max(ridge, 1e-12))
    # Misfit that counts as exact, as a fraction of the squared torque.
    floor = 1e-4 * float(weights @ moments.square)
    return max(float(weights @ (np.maximum(moments.count, 1) * moments.level(values) ** 2)), floor)


def _box(link: int, corners: tuple[ArrayLike, ArrayLike]) -> tuple[Array, Array]:
    lower, upper = (np.asarray(corner, dtype=float) for corner in corners)
    if lower.shape != (3,) or upper.shape != (3,) or not (lower <= upper).all():
        raise InputError(
            f"the box about link {link} is {lower.tolist()} to {upper.tolist()}", allowed="lower corner below upper"
        )
    return lower, upper


__all__ = ["PhysicallyConsistent", "body_columns", "standard_of"]
