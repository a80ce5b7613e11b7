"""The fit: Levenberg and Marquardt on a minimal set of parameters, with a robust loss."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimation.calibrations.weighting import Weights, least_squares_sigma, robust_weights
from robots.common.errors import SolverError
from robots.geometry_errors.measurements import Setup
from robots.geometry_errors.measurements.setup import moved_setup
from robots.geometry_errors.model import GeometryModel
from robots.geometry_errors.reduction import Reduction, reduce_columns
from robots.geometry_errors.terms import ErrorParameter

Array = NDArray[np.float64]

LARGEST = 30.0
"""Standard errors, in usual sizes of the parameter, from which on the poses do not determine it: 150 mrad of a zero."""

STEPS = 60
SMALL_STEP = 1e-6  # standard errors; a fit that moves less is done
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
        residual: (N, r).
        jacobian: (N, r, P + K).
        weights: of the poses and numbers.
        sigma: standard deviation by unit.
        hat: share of each number that the fit follows (N, r).
        covariance: of the parameters that were fitted, in the order of `reduction.kept`.
    """

    model: GeometryModel
    values: Array
    setup: Setup
    parameters: tuple[ErrorParameter, ...]
    reduction: Reduction
    residual: Array
    jacobian: Array
    weights: Weights
    hat: Array
    covariance: Array

    @property
    def used(self) -> Array:
        """Whether each pose counted (N,)."""
        return self.weights.pose > 0.0

    @property
    def freedom(self) -> int:
        """Measured numbers without those that parameters took."""
        return max(int(np.isfinite(self.residual[self.used]).sum()) - self.reduction.rank, 1)

    def scaled(self, columns: tuple[int, ...] | None = None) -> tuple[Array, Array]:
        """Jacobian and residual in standard deviations, numbers that were not measured left out.

        Args:
            columns: of the parameters; all by default.
        """
        return scaled_rows(self.residual, self.jacobian, self.weights, self.model, columns)


def scaled_rows(
    residual: Array, jacobian: Array, weights: Weights, model: GeometryModel, columns: tuple[int, ...] | None = None
) -> tuple[Array, Array]:
    """Gives the rows (R, P) and targets (R,) of least squares."""
    factor = weights.rows(model.poses.measurement.units)
    seen = np.isfinite(residual) & (factor > 0.0)
    chosen = jacobian if columns is None else jacobian[:, :, columns]
    return chosen[seen] * factor[seen][:, None], residual[seen] * factor[seen]


def preference(parameters: Sequence[ErrorParameter]) -> list[list[int]]:
    """Numbers of parameters in groups, in the order in which they are kept: the setup, then the kinds of errors."""
    kinds = dict.fromkeys(["setup", *(item.kind for item in parameters)])
    return [[k for k, item in enumerate(parameters) if item.kind == kind] for kind in kinds]


def fit_geometry(
    model: GeometryModel, *, start: tuple[Array, Setup] | None = None, used: Array | None = None, robust: bool = True
) -> GeometryFit:
    """Fits all errors of a model that the poses determine, and the setup.

    The minimal set is chosen by the rank of the scaled Jacobian of the nominal arm. At the solution, parameters are left
    out whose standard error would be `LARGEST` or more.

    Args:
        model: errors and poses.
        start: values of all errors and a setup; zero errors and the measurement's own start by default.
        used: whether a pose counts (N,); all by default.
        robust: whether poses that do not fit lose weight (Huber); otherwise least squares.

    Raises:
        SolverError: no step lowers the error, or numbers that are not finite.
    """
    rows = len(model.poses)
    counts = np.ones(rows) if used is None else np.asarray(used, dtype=float)
    values, setup = start if start is not None else (np.zeros(len(model.errors)), model.start())
    weights: Weights | None = None
    reduction: Reduction | None = None
    for _ in range(4):
        values, setup, weights, reduction, same = _solve(model, values, setup, weights, reduction, counts, robust)
        if same:
            break
    found = model.evaluate(values, setup)
    assert weights is not None
    parameters = model.parameters(setup)
    kept = reduction.kept
    weights, hat = _final_weights(model, found.residual, found.jacobian, weights, kept, counts, robust)
    matrix, _ = scaled_rows(found.residual, found.jacobian, weights, model, kept)
    lengths = np.maximum(np.linalg.norm(matrix, axis=0), np.finfo(float).tiny)
    triangle = np.linalg.qr(matrix / lengths, mode="r")
    back = np.linalg.solve(triangle, np.eye(len(kept))) / lengths[:, None]
    return GeometryFit(
        model=model,
        values=values,
        setup=setup,
        parameters=parameters,
        reduction=reduction,
        residual=found.residual,
        jacobian=found.jacobian,
        weights=weights,
        hat=hat,
        covariance=back @ back.T,
    )


def _solve(
    model: GeometryModel,
    values: Array,
    setup: Setup,
    weights: Weights | None,
    before: Reduction | None,
    used: Array,
    robust: bool,
) -> tuple[Array, Setup, Weights, Reduction, bool]:
    """Chooses the minimal set at a point and fits it; says whether the set is the one before."""
    units, errors = model.poses.measurement.units, len(model.errors)
    found = model.evaluate(values, setup)
    if not np.isfinite(found.residual).any():
        raise SolverError("no pose has a measurement that the model can predict")
    parameters = model.parameters(setup)
    scale = np.array([item.scale for item in parameters])
    known = robust_weights(found.residual, units, 0 if before is None else before.rank, used)
    if weights is not None:
        known = replace(known, sigma=weights.sigma) if not robust else known
    groups = preference(parameters)
    # Away from the nominal arm, what is redundant there looks new by a thousandth.
    nominal = found if before is not None else model.evaluate(np.zeros(errors), setup)
    matrix, _ = scaled_rows(found.residual, nominal.jacobian, replace(known, pose=used), model)
    if before is None:
        reduction = reduce_columns(matrix * scale, groups)
    else:
        # Before the first fit the residuals are no noise. Then what the noise hides is left out, too.
        groups = [[k for k in group if k in before.kept] for group in groups]
        reduction = reduce_columns(matrix * scale, groups, shortest=1.0 / LARGEST)
        if not reduction.dropped:
            return values, setup, known, before, True
    kept = list(reduction.kept)
    values = values.copy()
    values[[k for k in range(errors) if k not in kept]] = 0.0
    found = model.evaluate(values, setup)
    damping = 1e-3
    for _ in range(STEPS):
        known = robust_weights(found.residual, units, len(kept), used)
        if not robust:
            known = replace(known, pose=used)
        matrix, target = scaled_rows(found.residual, found.jacobian, known, model, tuple(kept))
        matrix = matrix * scale[kept]
        lengths = np.linalg.norm(matrix, axis=0)
        cost = float(target @ target)
        moved = False
        while damping < DAMPED:
            system = np.vstack([matrix, np.sqrt(damping) * np.diag(lengths)])
            step = np.linalg.lstsq(system, np.concatenate([target, np.zeros(len(kept))]), rcond=None)[0]
            whole = np.zeros(len(scale))
            whole[kept] = step * scale[kept]
            tried = values + whole[:errors], moved_setup(setup, whole[errors:])
            new = model.evaluate(*tried)
            _, remaining = scaled_rows(new.residual, new.jacobian[:, :, :0], known, model)
            if len(remaining) == len(target) and float(remaining @ remaining) <= cost:
                values, setup, found = *tried, new
                damping, moved = max(damping * GAIN, 1e-12), True
                break
            damping *= LOSS
        if not moved or float(np.max(np.abs(step) * lengths, initial=0.0)) < SMALL_STEP * np.sqrt(max(len(target), 1)):
            break
        damping = min(damping, 1.0)
    return values, setup, known, reduction, False


def _final_weights(
    model: GeometryModel, residual: Array, jacobian: Array, weights: Weights, kept: tuple[int, ...], used: Array, robust: bool
) -> tuple[Weights, Array]:
    """Standard deviations by the degrees of freedom of each unit, and the hat matrix's diagonal."""
    units = model.poses.measurement.units
    pose = weights.pose if robust else used
    weights = replace(weights, pose=pose)
    hat = np.zeros(residual.shape)
    for _ in range(1 if len(set(units)) == 1 else 6):
        factor = weights.rows(units)
        seen = np.isfinite(residual) & (factor > 0.0)
        matrix = jacobian[seen][:, list(kept)] * factor[seen][:, None]
        matrix = matrix / np.maximum(np.linalg.norm(matrix, axis=0), np.finfo(float).tiny)
        basis = np.linalg.qr(matrix, mode="reduced")[0]
        hat[seen] = np.sum(basis**2, axis=1)
        # A weight of less than one counts as that share of a pose.
        shared = residual * np.sqrt(np.where(pose > 0, pose, 1.0))[:, None] if robust else residual
        weights = replace(weights, sigma=least_squares_sigma(shared, hat, units, used))
    return weights, hat
