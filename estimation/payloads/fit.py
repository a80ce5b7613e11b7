"""Weighted least squares for a payload and the arm together, and the payload's covariance under coloured noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimation.linear_algebra.scaled import floored_inverse
from estimation.payloads.equations import Arm, Equations
from estimation.regressions.moments import Moments
from estimation.uncertainty import Part, covariance, with_repetitions
from estimation.uncertainty.averages import AVERAGING_TIME
from robots.common.arrays import Array
from robots.geometry.inertia import BODY_PARAMETERS


@dataclass(frozen=True, kw_only=True)
class PayloadFit:
    """Least squares without constraints.

    Attributes:
        values: ten inertial parameters in the flange's frame (10,).
        covariance: (10, 10).
        residual: RMS of the torque error with the payload (c,) [N m or N].
        without: RMS of the torque error if there were none (c,).
        rows: number of rows.
    """

    values: Array
    covariance: Array
    residual: Array
    without: Array
    rows: int


def fit_payload(arm: Arm, equations: Sequence[Equations], *, period: float, seed: int = 0) -> PayloadFit:
    """Fits the payload and the arm's parameters to all equations.

    The channels are weighted by their inverse noise. The arm's prior knowledge counts as data with its own scatter;
    the covariance of the rest is a sandwich, see `estimation.uncertainty.with_repetitions`.

    Args:
        arm: prior knowledge of the arm.
        equations: of the logs, alike in their channels.
        period: median period of the rows [s].
        seed: of the noise drawn to correct the standard errors.
    """
    parts = [(some, at) for some in equations for at in some.chunks()]
    moments = _sum(
        [Moments.of(some.regressor(at.start, at.stop), some.target[at], some.mask[at]) for some, at in parts]
    )
    known, scatter, target = _prior(arm, moments)
    weights = moments.level(np.zeros(arm.size)) ** -2
    values = np.zeros(arm.size)
    # Weights and residuals adapt to each other in these rounds.
    for _ in range(4):
        inverse = floored_inverse(np.tensordot(weights, moments.gram, axes=1) + known)
        values = inverse @ (weights @ moments.cross + known @ target)
        weights = moments.level(values) ** -2
    inverse = floored_inverse(np.tensordot(weights, moments.gram, axes=1) + known)
    values = inverse @ (weights @ moments.cross + known @ target)
    used = [np.flatnonzero(np.diag(gram) > 0) for gram in moments.gram]
    rows = sum(some.rows for some in equations)
    errors = [Part(some.rows, some.regressor, some.mask, _residual(some, values), used) for some in equations]
    # As in the identification: 10,000 averages remain at least.
    averaged = min(round(AVERAGING_TIME / period), rows // 10_000)
    full = covariance(errors, weights, inverse, seed, averaged=averaged)
    full = with_repetitions(full, errors, [some.played for some in equations], weights, inverse, seed, averaged)
    full = full + inverse @ scatter @ inverse
    arm_alone = _without(moments, weights, known, target)
    return PayloadFit(
        values=values[-BODY_PARAMETERS:],
        covariance=full[-BODY_PARAMETERS:, -BODY_PARAMETERS:],
        residual=moments.level(values),
        without=moments.level(arm_alone),
        rows=rows,
    )


def _sum(moments: Sequence[Moments]) -> Moments:
    total = moments[0]
    for more in moments[1:]:
        total = total + more
    return total


def _prior(arm: Arm, moments: Moments) -> tuple[Array, Array, Array]:
    """Weight (p, p) of what is known before, its scatter in the same units (p, p), and what it says (p,)."""
    b, size = len(arm.columns), arm.size
    torque = float(np.sqrt((moments.square / np.maximum(moments.count, 1)).max()))
    # A payload's parameters are known to 30 kg, kg m and kg m2 before any log, times the mass that the torques could
    # hold at a lever of 0.1 m. What a log leaves open keeps this spread, and is reported as not determined.
    spread = 30.0 * max(torque / (9.81 * 0.1), 1.0)
    known, scatter, target = np.zeros((size, size)), np.zeros((size, size)), np.zeros(size)
    known[:b, :b] = arm.weight * arm.precision
    scatter[:b, :b] = arm.weight**2 * arm.precision
    known[range(b, size), range(b, size)] = scatter[range(b, size), range(b, size)] = spread**-2
    target[:b] = arm.target
    return known, scatter, target


def _residual(equations: Equations, values: Array) -> Array:
    errors = np.empty_like(equations.target)
    for at in equations.chunks():
        fitted = equations.regressor(at.start, at.stop) @ values
        errors[at] = (equations.target[at] - fitted) * equations.mask[at]
    return errors


def _without(moments: Moments, weights: Array, known: Array, target: Array) -> Array:
    """The parameters (p,) that fit best if there is no payload."""
    b = len(target) - BODY_PARAMETERS
    gram, cross = np.tensordot(weights, moments.gram, axes=1) + known, weights @ moments.cross + known @ target
    values = np.zeros(len(target))
    values[:b] = floored_inverse(gram[:b, :b]) @ cross[:b]
    return values
