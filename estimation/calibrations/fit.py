"""The fit: Levenberg and Marquardt on a minimal set of parameters, with a robust loss and a prior of estimated size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimation.calibrations.sizes import LARGEST, Normal, estimate_sizes, kind_numbers
from estimation.calibrations.weighting import Weights, least_squares_sigma, robust_weights
from robots.common.arrays import Array
from robots.common.errors import SolverError
from robots.geometry_errors.measurements import Setup
from robots.geometry_errors.measurements.setup import moved_setup
from robots.geometry_errors.model import GeometryModel, Prediction
from robots.geometry_errors.reduction import Reduction, reduce_columns
from robots.geometry_errors.terms import ErrorParameter

STEPS, REFITS = 60, 5
SMALL_STEP = 1e-6  # standard errors; a fit that moves less is done
SAME = 0.02  # a relative change of sizes that asks for no other fit
GAIN, LOSS, DAMPED = 0.2, 10.0, 1e9  # of the damping, after a good and a bad step; where it ends


@dataclass(frozen=True, kw_only=True, eq=False)
class GeometryFit:
    """A fit of a model to poses.

    Attributes:
        model: what was fitted.
        values: all P errors; those that were left out are zero.
        setup: the setup.
        parameters: the P errors, then the K parameters of the setup.
        reduction: which of them were fitted.
        sizes: standard deviation of the parameters of each kind, in their usual sizes.
        residual: (N, r).
        jacobian: (N, r, P + K).
        weights: of the poses and numbers.
        hat: share of each number that the fit follows (N, r).
        covariance: of the parameters that were fitted, in the order of `reduction.kept`.
    """

    model: GeometryModel
    values: Array
    setup: Setup
    parameters: tuple[ErrorParameter, ...]
    reduction: Reduction
    sizes: Mapping[str, float]
    residual: Array
    jacobian: Array
    weights: Weights
    hat: Array
    covariance: Array

    @property
    def used(self) -> NDArray[np.bool_]:
        """Whether each pose counted (N,)."""
        return np.asarray(self.weights.pose > 0.0)

    @property
    def freedom(self) -> int:
        """Measured numbers without those that parameters took."""
        used = self.used
        return max(int(np.isfinite(self.residual[used]).sum() - self.hat[used].sum()), 1)


def scaled_rows(
    found: Prediction, weights: Weights, model: GeometryModel, columns: Sequence[int] | None = None
) -> tuple[Array, Array]:
    """Gives the rows (R, P) and targets (R,) of least squares; what was not measured is left out."""
    factor = weights.rows(model.poses.measurement.units)
    seen = np.isfinite(found.residual) & (factor > 0.0)
    jacobian = found.jacobian if columns is None else found.jacobian[:, :, list(columns)]
    return jacobian[seen] * factor[seen][:, None], _scaled(found.residual, weights, model)


def _scaled(residual: Array, weights: Weights, model: GeometryModel) -> Array:
    factor = weights.rows(model.poses.measurement.units)
    seen = np.isfinite(residual) & (factor > 0.0)
    return np.asarray(residual[seen] * factor[seen])


def preference(parameters: Sequence[ErrorParameter]) -> list[list[int]]:
    """Numbers of parameters in groups, in the order in which they are kept: the setup, then the kinds of errors."""
    kinds = dict.fromkeys(["setup", *(item.kind for item in parameters)])
    return [[k for k, item in enumerate(parameters) if item.kind == kind] for kind in kinds]


def minimal_set(model: GeometryModel, setup: Setup, weights: Weights, kept: Reduction | None = None) -> Reduction:
    """Chooses the parameters that the poses tell apart, by the rank of the nominal arm's Jacobian.

    Away from the nominal arm, what is redundant there looks new by a thousandth.

    Args:
        model: errors and poses.
        setup: of the measurement.
        weights: of the poses and numbers.
        kept: an earlier choice. Of it only those stay whose standard error is below the largest size of a parameter.
    """
    parameters = model.parameters(setup)
    scale = np.array([item.scale for item in parameters])
    matrix, _ = scaled_rows(model.evaluate(np.zeros(len(model.errors)), setup), weights, model)
    groups = preference(parameters)
    if kept is None:
        return reduce_columns(matrix * scale, groups)
    again = reduce_columns(
        matrix * scale, [[k for k in group if k in kept.kept] for group in groups], shortest=1.0 / LARGEST
    )
    return again if again.dropped else kept


def fit_geometry(
    model: GeometryModel,
    *,
    start: tuple[Array, Setup] | None = None,
    used: Array | None = None,
    robust: bool = True,
    sizes: Mapping[str, float] | None = None,
) -> GeometryFit:
    """Fits all errors of a model that the poses determine, and the setup.

    Errors of a kind have a normal prior, whose size is estimated from the poses by the marginal likelihood. It changes
    nothing where the poses determine an error well.

    Args:
        model: errors and poses.
        start: values of all errors and a setup; zero errors and the measurement's own start by default.
        used: whether a pose counts (N,); all by default.
        robust: whether poses that do not fit lose weight (Huber).
        sizes: of the kinds, to start from.

    Raises:
        SolverError: no pose has a measurement, or numbers that are not finite.
    """
    counts = np.ones(len(model.poses)) if used is None else np.asarray(used, dtype=float)
    values, setup = start if start is not None else (np.zeros(len(model.errors)), model.start())
    found = model.evaluate(values, setup)
    if not np.isfinite(found.residual[counts > 0]).any():
        raise SolverError("no pose has a measurement that the model can predict")
    units = model.poses.measurement.units
    kinds = list(dict.fromkeys(item.kind for item in model.errors))
    known = dict.fromkeys(kinds, LARGEST) | {k: v for k, v in (sizes or {}).items() if k in kinds}
    reduction = minimal_set(model, setup, replace(robust_weights(found.residual, units, 0, counts), pose=counts))
    values = _only(values, reduction)
    state = _State(model, values, setup, found, robust_weights(found.residual, units, reduction.rank, counts))
    for round_ in range(REFITS):
        state = _search(state, reduction, known, counts, robust)
        fewer = minimal_set(model, state.setup, replace(state.weights, pose=counts), reduction)
        before = known
        known = _sizes(state, fewer, known)
        settled = all(abs(np.log(known[kind] / before[kind])) < SAME for kind in kinds)
        if fewer is reduction and settled:
            break
        reduction = fewer
        if round_ == REFITS - 1:
            state = _search(state, reduction, known, counts, robust)
    weights, hat, covariance = _spread(state, reduction, known, counts, robust)
    return GeometryFit(
        model=model,
        values=state.values,
        setup=state.setup,
        parameters=model.parameters(state.setup),
        reduction=reduction,
        sizes=known,
        residual=state.found.residual,
        jacobian=state.found.jacobian,
        weights=weights,
        hat=hat,
        covariance=covariance,
    )


@dataclass(frozen=True, eq=False)
class _State:
    model: GeometryModel
    values: Array
    setup: Setup
    found: Prediction
    weights: Weights


def _only(values: Array, reduction: Reduction) -> Array:
    result = np.zeros_like(values)
    kept = [k for k in reduction.kept if k < len(values)]
    result[kept] = values[kept]
    return result


def _prior(state: _State, kept: Sequence[int], sizes: Mapping[str, float]) -> tuple[Array, Array]:
    """Inverse sizes of the kept columns, and their values, both in usual sizes (K,)."""
    parameters = state.model.parameters(state.setup)
    errors = len(state.values)
    inverse = np.array([1.0 / sizes[parameters[k].kind] if k < errors else 0.0 for k in kept])
    value = np.array([state.values[k] / parameters[k].scale if k < errors else 0.0 for k in kept])
    return inverse, value


def _search(state: _State, reduction: Reduction, sizes: Mapping[str, float], used: Array, robust: bool) -> _State:
    """Levenberg and Marquardt with weights that follow the residuals."""
    model, kept = state.model, list(reduction.kept)
    units, errors = model.poses.measurement.units, len(state.values)
    scale = np.array([item.scale for item in model.parameters(state.setup)])
    values, setup = _only(state.values, reduction), state.setup
    found = model.evaluate(values, setup)
    weights, damping = state.weights, 1e-3
    for _ in range(STEPS):
        weights = robust_weights(found.residual, units, len(kept), used)
        weights = weights if robust else replace(weights, pose=used)
        matrix, target = scaled_rows(found, weights, model, kept)
        now = _State(model, values, setup, found, weights)
        inverse, value = _prior(now, kept, sizes)
        # Normal equations in columns of length one: a step that rounding makes inexact is mended by the next.
        matrix = matrix * scale[kept]
        lengths = np.sqrt(np.sum(matrix**2, axis=0) + inverse**2)
        lengths = np.maximum(lengths, np.finfo(float).tiny)
        gram = (matrix.T @ matrix + np.diag(inverse**2)) / np.outer(lengths, lengths)
        aim = (matrix.T @ target - inverse**2 * value) / lengths
        cost, rows = float(target @ target) + float(np.sum((inverse * value) ** 2)), len(target)
        moved = False
        while damping < DAMPED:
            step = _solved(gram + damping * np.eye(len(kept)), aim) / lengths
            whole = np.zeros(len(scale))
            whole[kept] = step * scale[kept]
            tried = values + whole[:errors], moved_setup(setup, whole[errors:])
            remaining = _scaled(model.residual(*tried), weights, model)
            left = float(remaining @ remaining) + float(np.sum((inverse * (value + step)) ** 2))
            if len(remaining) == rows and left <= cost:
                values, setup, found = *tried, model.evaluate(*tried)
                damping, moved = max(damping * GAIN, 1e-12), True
                break
            damping *= LOSS
        if not moved or float(np.max(np.abs(step) * lengths, initial=0.0)) < SMALL_STEP * np.sqrt(max(rows, 1)):
            break
        damping = min(damping, 1.0)
    return _State(model, values, setup, found, weights)


def _solved(matrix: Array, right: Array) -> Array:
    """Solves normal equations; what they do not determine stays where it is."""
    values, vectors = np.linalg.eigh(matrix)
    least = np.finfo(float).eps * values.max(initial=0.0)
    inverse = np.where(values > least, 1.0 / np.maximum(values, np.finfo(float).tiny), 0.0)
    return np.asarray(vectors @ (inverse * (vectors.T @ right)))


def _sizes(state: _State, reduction: Reduction, sizes: Mapping[str, float]) -> dict[str, float]:
    """Sizes of the kinds at a solution."""
    kept, names = list(reduction.kept), list(sizes)
    parameters = state.model.parameters(state.setup)
    scale = np.array([item.scale for item in parameters])[kept]
    matrix, target = scaled_rows(state.found, state.weights, state.model, kept)
    matrix = matrix * scale
    _, value = _prior(state, kept, sizes)
    normal = Normal.of(matrix, target + matrix @ value)
    numbers = kind_numbers([parameters[k].kind for k in kept], names)
    found, _, _ = estimate_sizes(normal, numbers, np.array([sizes[name] for name in names]))
    return dict(zip(names, found.tolist(), strict=True))


def _spread(
    state: _State, reduction: Reduction, sizes: Mapping[str, float], used: Array, robust: bool
) -> tuple[Weights, Array, Array]:
    """Standard deviations by the degrees of freedom of each unit, the hat matrix's diagonal, and the covariance."""
    units, residual, kept = state.model.poses.measurement.units, state.found.residual, list(reduction.kept)
    scale = np.array([item.scale for item in state.model.parameters(state.setup)])[kept]
    weights = replace(state.weights, pose=state.weights.pose if robust else used)
    inverse, _ = _prior(state, kept, sizes)
    hat = np.zeros(residual.shape)
    # A weight of less than one counts as that share of a pose.
    shared = residual * np.sqrt(weights.pose)[:, None]
    for _ in range(6):
        matrix, _ = scaled_rows(state.found, weights, state.model, kept)
        matrix = np.vstack([matrix * scale, np.diag(inverse)])
        lengths = np.maximum(np.linalg.norm(matrix, axis=0), np.finfo(float).tiny)
        triangle = np.asarray(np.linalg.qr(matrix / lengths, mode="r"))
        seen = np.isfinite(residual) & (weights.rows(units) > 0.0)
        basis = (matrix[: int(seen.sum())] / lengths) @ np.linalg.inv(triangle)
        hat[seen] = np.sum(basis**2, axis=1)
        before = dict(weights.sigma)
        weights = replace(weights, sigma=least_squares_sigma(shared, hat, units, used))
        if all(abs(np.log(weights.sigma[unit] / before[unit])) < 1e-3 for unit in before):
            break
    back = scale[:, None] * np.linalg.solve(triangle, np.eye(len(kept))) / lengths[:, None]
    return weights, hat, back @ back.T
