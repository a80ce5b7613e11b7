"""Outlier poses: those whose measurement a fit to the others does not predict within the noise."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimation.calibrations.fit import GeometryFit, fit_geometry, scaled_rows
from estimation.uncertainty.quantiles import chi2_limit, normal_limit, robust_deviation
from robots.common.arrays import Array
from robots.geometry_errors.model import Prediction

ALPHA = 0.001
"""Probability that a calibration without outliers names one."""

MOST = 0.25  # of the poses; more are no outliers but a model that does not hold
REMAINING = 1e-6  # of a pose's own freedom; below it no other pose says anything about it


@dataclass(frozen=True, kw_only=True)
class OutlierPose:
    """A pose that was left out.

    Attributes:
        pose: its number, from 1.
        line: of the file.
        error: of the prediction by the other poses, in the measurement's first unit.
        ratio: its distance in units of the usual distance of a pose.
    """

    pose: int
    line: int
    error: float
    ratio: float


def deletion_statistics(fit: GeometryFit) -> tuple[Array, Array, Array]:
    """Squared distance of each pose from the prediction by the others, its degrees of freedom, and that residual.

    ``e' (1 - H)^-1 e / sigma^2`` with the pose's block H of the hat matrix (Cook and Weisberg 1982, section 2.2).

    Args:
        fit: whose weights are one or zero.

    Returns:
        (N,), (N,), and residuals (N, r) with NaN where nothing was measured.
    """
    model, kept = fit.model, list(fit.reduction.kept)
    poses = model.poses
    everyone = replace(fit.weights, pose=np.ones(len(poses)))
    found = Prediction(residual=fit.residual, jacobian=fit.jacobian)
    scale = np.array([item.scale for item in fit.parameters])[kept]
    matrix, _ = scaled_rows(found, fit.weights, model, kept)
    prior = np.diag([1.0 / fit.sizes[fit.parameters[k].kind] if k < len(fit.values) else 0.0 for k in kept])
    stacked = np.vstack([matrix * scale, prior])
    lengths = np.maximum(np.linalg.norm(stacked, axis=0), np.finfo(float).tiny)
    triangle = np.asarray(np.linalg.qr(stacked / lengths, mode="r"))
    own, target = scaled_rows(found, everyone, model, kept)
    basis = np.linalg.solve(triangle.T, (own * scale / lengths).T).T
    number = np.nonzero(np.isfinite(fit.residual))[0]
    statistic, freedom = np.zeros(len(poses)), np.zeros(len(poses))
    predicted = np.full(fit.residual.shape, np.nan)
    sigma = np.array([fit.weights.sigma[unit] for unit in poses.measurement.units])
    for pose in np.unique(number):
        rows = number == pose
        hat = basis[rows] @ basis[rows].T
        # A pose that did not count has no share in the fit: its residual is that of a prediction.
        size = np.eye(len(hat)) - hat if fit.used[pose] else np.eye(len(hat)) + hat
        values, vectors = np.linalg.eigh(size)
        open_ = values > REMAINING
        turned = vectors[:, open_].T @ target[rows]
        statistic[pose], freedom[pose] = float(np.sum(turned**2 / values[open_])), int(open_.sum())
        seen = np.isfinite(fit.residual[pose])
        deleted = vectors[:, open_] @ (turned / values[open_]) if fit.used[pose] else target[rows]
        predicted[pose, seen] = deleted * sigma[seen]
    return statistic, freedom, predicted


def _excess(statistic: Array, freedom: Array, used: NDArray[np.bool_]) -> Array:
    """How far each pose is beyond what chance allows (N,): above one it is an outlier.

    It has to be far by chi-square, and far beside the other poses: what a model misses is not independent within a
    pose, so that all poses are spread more widely. The cube root is nearly normal (Wilson and Hilferty 1931).
    """
    limits = np.array([chi2_limit(ALPHA, max(int(f), 1), len(used)) for f in freedom])
    root = np.cbrt(statistic / np.maximum(freedom, 1.0))
    middle = float(np.median(root[used]))
    spread = max(float(robust_deviation(root[used] - middle)), np.finfo(float).tiny)
    return np.minimum(statistic / limits, (root - middle) / spread / normal_limit(2.0 * ALPHA, len(used)))


def without_outliers(start: GeometryFit) -> tuple[GeometryFit, tuple[OutlierPose, ...]]:
    """Leaves poses out one by one, the farthest first, and fits the others by least squares.

    Args:
        start: a robust fit.

    Returns:
        The fit to the others, and the poses that were left out.
    """
    model = start.model
    poses = model.poses
    used = np.ones(len(poses), dtype=bool)
    fit = fit_geometry(model, start=(start.values, start.setup), robust=False, sizes=start.sizes)
    # The robust fit's noise level is free of outliers; later ones have too few poses left in doubt to matter.
    fit = replace(fit, weights=replace(fit.weights, sigma=start.weights.sigma))
    for _ in range(int(MOST * len(poses))):
        statistic, freedom, _ = deletion_statistics(fit)
        ratio = np.where(used, _excess(statistic, freedom, used), 0.0)
        worst = int(np.argmax(ratio))
        if ratio[worst] <= 1.0:
            break
        used[worst] = False
        fit = fit_geometry(model, start=(fit.values, fit.setup), used=used.astype(float), robust=False, sizes=fit.sizes)
    statistic, freedom, predicted = deletion_statistics(fit)
    error = poses.measurement.error(predicted)
    assert poses.line is not None
    found = tuple(
        OutlierPose(
            pose=int(k) + 1,
            line=int(poses.line[k]),
            error=float(error[k]),
            ratio=float(np.sqrt(statistic[k] / max(freedom[k], 1.0))),
        )
        for k in np.flatnonzero(~used)
    )
    return fit, tuple(sorted(found, key=lambda item: -item.ratio))
