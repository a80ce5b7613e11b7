"""Covariance of estimates whose normal equations are not those of plain least squares on the measured motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from estimation.linear_algebra import scaled
from estimation.regressions.moments import Array
from estimation.uncertainty import Part, covariance
from robots.base_parameters import BaseParameters
from robots.signals import Motion

# Keeps the inverse finite where the data leave directions open: standard errors are those without regularisation.
COVARIANCE_RIDGE = 1e-13


@dataclass(frozen=True)
class Equations:
    """The rows of one part that an estimate solves: sum_i Z_i' W (tau_i - Y_i pi) = 0.

    Attributes:
        rows: number of samples N.
        regressor: (start, stop) -> Z (stop - start, n, b).
        mask: (N, n).
        residual: tau - Y pi (N, n).
    """

    rows: int
    regressor: Callable[[int, int], Array]
    mask: Array
    residual: Array


def robust_covariance(
    equations: Sequence[Equations], weights: Array, gram: Array, inverse: Array | None = None
) -> Array:
    """Estimates the covariance (b, b) of an estimate under coloured noise.

    Args:
        equations: one per part.
        weights: of the joints' rows (n,).
        gram: Z' W Z (b, b); where Z is free of noise, Z' W Y is that on average.
        inverse: what turns Z' W e into the estimate's error (b, b), where that is not the inverse of `gram`.

    Returns:
        The sandwich of `estimation.uncertainty`.
    """
    if inverse is None:
        inverse = scaled.inverse(gram, COVARIANCE_RIDGE)
    parts = [Part(e.rows, e.regressor, e.mask, e.residual * e.mask) for e in equations]
    return covariance(parts, weights, (inverse + inverse.T) / 2)


def regressor_rows(base: BaseParameters, motion: Motion, start: int, stop: int, gravity: Array | None = None) -> Array:
    """Evaluates some rows of a motion's regressor (stop - start, n, b), under another gravity (3,) where given."""
    rows = slice(start, stop)
    return base.regressor(motion.q[rows], motion.dq[rows], motion.ddq[rows], gravity=gravity)
