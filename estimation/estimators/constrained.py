"""Weighted least squares under bounds, signs of friction and a known total mass."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from difflib import get_close_matches
from functools import partial

import numpy as np
from scipy.linalg import null_space

from estimation.estimators.base import Array, Solution
from estimation.estimators.wls import WeightedLeastSquares
from estimation.linear_algebra.scaled import square_root
from estimation.regressions.covariances import COVARIANCE_RIDGE, Equations, regressor_rows, robust_covariance
from estimation.regressions.regression_data import RegressionData
from estimation.regressions.regularisation import regularisation
from estimation.regressions.standard_parameters import body_columns, largest_speed, nonnegative_rows, scaling
from robots.common.errors import InfeasibleError, InputError, SolverError
from robots.regressor import TorqueModel


class ConstrainedLeastSquares(WeightedLeastSquares):
    """min sum_j w_j ||tau_j - Y_j G pi||^2 over standard parameters pi within bounds: a quadratic program.

    By default masses, rotor inertias, Coulomb and viscous friction are not negative, and friction brakes at every speed
    seen. The solution's extras: ``standard`` (p,), and ``active``, the names of parameters at a bound of their own.

    What is known exactly (a bound whose ends meet, a total mass) takes its share of the uncertainty away: errors move
    along what stays free. At any other bound they are those without it. A bound that holds takes the estimate nearer to
    the truth on the torque's scale, never farther: intervals hold more often than stated there, not less.

    Args:
        bounds: standard parameters by name, such as ``f1_3`` or ``m_2``, to their lowest and highest value; infinite
            where there is none.
        total_mass: sum of the moving links' masses [kg], or the lowest and highest.
        signs: whether the default signs are demanded.
        temper: see `WeightedLeastSquares`.

    Raises:
        InputError: a bound or mass that no number is between.
    """

    name = "constrained"

    def __init__(
        self,
        *,
        bounds: Mapping[str, tuple[float, float]] | None = None,
        total_mass: float | tuple[float, float] | None = None,
        signs: bool = True,
        temper: float = 1.0,
    ) -> None:
        super().__init__(temper)
        self.bounds = dict(bounds or {})
        self.total_mass = (total_mass, total_mass) if isinstance(total_mass, int | float) else total_mass
        self.signs = signs
        ranges = {**self.bounds, **({} if self.total_mass is None else {"total_mass": self.total_mass})}
        for name, (lower, upper) in ranges.items():
            if not lower <= upper:
                raise InputError(f"bounds {lower} to {upper}", column=name, allowed="the lower one first")

    def refine(self, data: RegressionData, values: Array, weights: Array) -> Solution:
        """Solves the quadratic program.

        Raises:
            InputError: a bound on a parameter that the model has not, or a mass of a model without links.
            InfeasibleError: bounds that contradict each other.
            SolverError: the solver gave up.
        """
        model = data.base.model
        units = scaling(data)
        scale = units.scale
        limits = self._limits(model)
        rows, lower, upper = self._rows(model, largest_speed(data))
        gram = np.tensordot(weights, data.moments.gram, axes=1)
        extra, right = regularisation(data.moments, weights, gram, data.ridge)
        level = float(weights @ (np.maximum(data.moments.count, 1) * data.moments.level(values) ** 2))
        root = square_root(gram + extra).T / np.sqrt(level)  # root' root = (gram + extra) / level
        grouping = data.base.grouping * scale
        target = np.linalg.lstsq(root.T, (weights @ data.moments.cross + right) / level, rcond=None)[0]
        reference = np.zeros(model.size)
        reference[units.bodies] = units.unit_reference
        # Weak prior for undetermined directions: the description, or a plausible arm. Far below the data's information.
        pull = np.full(model.size, np.sqrt(1e-8))
        standard = scale * _solve(
            np.vstack([root @ grouping, np.diag(pull)]),
            np.concatenate([target, pull * reference]),
            np.vstack([np.eye(model.size), rows * scale]),
            np.concatenate([limits[:, 0] / scale, lower]),
            np.concatenate([limits[:, 1] / scale, upper]),
        )
        standard = np.clip(standard, limits[:, 0], limits[:, 1])
        active = np.isclose(standard, limits[:, 0], rtol=1e-6, atol=1e-9) | np.isclose(
            standard, limits[:, 1], rtol=1e-6, atol=1e-9
        )
        # A parameter within this share of its own scale of a bound lies at it.
        alone = rows[
            (np.count_nonzero(rows, axis=1) == 1) & (np.abs(rows @ standard - lower) <= 1e-6 * (np.abs(rows) @ scale))
        ]
        active |= (alone != 0).any(axis=0)
        names = tuple(name for name, bound in zip(model.names, active, strict=True) if bound)
        values = data.base.from_standard(standard)
        fixed = np.vstack([np.eye(model.size)[limits[:, 0] == limits[:, 1]], rows[lower == upper]]) * scale
        return Solution(
            values=values,
            weights=weights,
            covariance=_covariance(data, values, weights, grouping, fixed) if len(fixed) else None,
            extras={"standard": standard, "active": names},
        )

    def _limits(self, model: TorqueModel) -> Array:
        limits = np.tile([-np.inf, np.inf], (model.size, 1))
        if self.signs:
            limits[[k for k, column in enumerate(model.columns) if column.symbol == "m"], 0] = 0.0
        for name, (lower, upper) in self.bounds.items():
            if name not in model.names:
                near = get_close_matches(name, model.names, n=3)
                raise InputError(f"unknown parameter {name}", allowed=f"such as {', '.join(near or model.names[:3])}")
            limits[model.names.index(name)] = lower, upper
        return limits

    def _rows(self, model: TorqueModel, speed: Array) -> tuple[Array, Array, Array]:
        rows = nonnegative_rows(model, speed) if self.signs else np.zeros((0, model.size))
        lower, upper = np.zeros(len(rows)), np.full(len(rows), np.inf)
        if self.total_mass is not None:
            bodies = body_columns(model)
            if not len(bodies):
                raise InputError("a total mass, but the model has no links", remedy="remove the total mass")
            row = np.zeros((1, model.size))
            row[0, bodies[:, 0]] = 1.0
            rows = np.vstack([rows, row])
            lower, upper = np.append(lower, self.total_mass[0]), np.append(upper, self.total_mass[1])
        return rows, lower, upper


def _covariance(data: RegressionData, values: Array, weights: Array, grouping: Array, fixed: Array) -> Array:
    """Covariance (b, b) where fixed @ scaled standard parameters are known: noise moves along their null space only."""
    gram = np.tensordot(weights, data.moments.gram, axes=1)
    level = float(np.trace(grouping.T @ gram @ grouping)) / grouping.shape[1]
    free = null_space(fixed)
    normal = free.T @ (grouping.T @ gram @ grouping / level + COVARIANCE_RIDGE * np.eye(grouping.shape[1])) @ free
    moved = grouping @ free
    inverse = moved @ np.linalg.solve(normal, moved.T) / level
    equations = [
        Equations(
            rows=len(part.motion),
            regressor=partial(regressor_rows, data.base, part.motion, gravity=part.gravity),
            mask=part.mask,
            residual=part.tau
            - data.base.torque(part.motion.q, part.motion.dq, part.motion.ddq, values, gravity=part.gravity),
        )
        for part in data.parts
    ]
    return robust_covariance(equations, weights, gram, (inverse + inverse.T) / 2)


def _solve(matrix: Array, target: Array, rows: Array, lower: Array, upper: Array) -> Array:
    """Min ||matrix x - target||^2 with lower <= rows x <= upper."""
    import cvxpy

    x = cvxpy.Variable(matrix.shape[1])
    below, above, fixed = np.isfinite(lower) & (lower < upper), np.isfinite(upper) & (lower < upper), lower == upper
    constraints = [rows[below] @ x >= lower[below], rows[above] @ x <= upper[above], rows[fixed] @ x == lower[fixed]]
    problem = cvxpy.Problem(
        cvxpy.Minimize(cvxpy.sum_squares(matrix @ x - target)), [c for c in constraints if c.shape[0]]
    )
    try:
        with warnings.catch_warnings():
            # The status below says it, too.
            warnings.filterwarnings("ignore", "Solution may be inaccurate", UserWarning)
            problem.solve(solver=cvxpy.CLARABEL, max_threads=1)
    except cvxpy.error.SolverError as error:
        raise SolverError(f"constrained fit: {error}", remedy="check the bounds") from error
    if problem.status in (cvxpy.INFEASIBLE, cvxpy.INFEASIBLE_INACCURATE):
        raise InfeasibleError("constrained fit: no parameters obey all bounds", remedy="relax the bounds")
    if problem.status not in (cvxpy.OPTIMAL, cvxpy.OPTIMAL_INACCURATE):
        raise SolverError(f"constrained fit: Clarabel ended with {problem.status}", remedy="check the bounds")
    return np.asarray(x.value, dtype=float)
