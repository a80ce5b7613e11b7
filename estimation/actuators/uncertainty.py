"""Standard errors of fitted drives, and what the motion does not determine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.actuators.fitting import FINE, PRIOR, Fit, normal_equations
from estimation.actuators.simulated_error import Errors, simulate_runs
from estimation.uncertainty.blocks import moving_block_sums
from estimation.uncertainty.correlations import correlation_rows
from estimation.uncertainty.quantiles import NORMAL_95
from estimation.uncertainty.sandwich import Part, at_least, covariance
from robots.common.arrays import Array

RESAMPLES = 500
MEMORIES, LONGEST = 5, 0.1
"""Length of a block in times of the error's memory, and as a share of all rows at most."""
TOGETHER = 0.9
"""Correlation from which on two values are named as one combination."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Uncertainty:
    """Errors of the free parameters, scaled by their sizes.

    Attributes:
        covariance: of the scaled parameters (K, K).
        determined: which are known better than their size or value (K,).
        partners: per parameter the indices of those that it is known together with.
    """

    covariance: Array
    determined: NDArray[np.bool_]
    partners: tuple[tuple[int, ...], ...]

    @property
    def standard_errors(self) -> Array:
        """Of the scaled parameters (K,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))


def uncertainty_of(fit: Fit, seed: int = 0) -> Uncertainty:
    """Estimates standard errors: a sandwich of coloured noise, and at least those of a moving block bootstrap.

    Args:
        fit: with derivatives at its values, see `polished`.
        seed: of the bootstrap.
    """
    size = len(fit.theta)
    gram, _ = normal_equations(fit.errors, fit.weights)
    gram[np.diag_indices(size)] += PRIOR**-2
    inverse = np.linalg.inv(gram)
    inverse = (inverse + inverse.T) / 2
    found = covariance([_part(part) for part in fit.errors], fit.weights, inverse, seed)
    found = at_least(found, _bootstrap(fit, inverse, seed))
    # A direction that no data show has the prior's width, which noise does not know of.
    total = at_least(found, np.diag(inverse @ inverse) / PRIOR**2) + np.diag(_step_error(fit, inverse) ** 2)
    errors = np.sqrt(np.diag(total))
    determined = NORMAL_95 * errors < np.maximum(np.abs(fit.theta), 1.0)
    return Uncertainty(covariance=total, determined=determined, partners=_partners(total, determined))


def _part(part: Errors) -> Part:
    assert part.jacobian is not None
    jacobian = part.jacobian
    used = [np.flatnonzero(jacobian[:, j].any(axis=0)) for j in range(jacobian.shape[1])]
    mask = np.broadcast_to(part.run.counted[:, None], part.error.shape).astype(float)
    return Part(
        rows=len(jacobian),
        regressor=lambda start, stop: jacobian[start:stop],
        mask=mask,
        residual=part.error,
        used=used,
    )


def _step_error(fit: Fit, inverse: Array) -> Array:
    """Error of the parameters (K,) by the length of the steps: twice what halves change, being of first order."""
    runs = [part.run for part in fit.errors]
    finer = simulate_runs(fit.freedom.fleet, fit.values, runs, refinement=2 * FINE)
    total = np.zeros(len(inverse))
    for part, other in zip(fit.errors, finer, strict=True):
        assert part.jacobian is not None
        total += np.einsum("tjk,tj->k", part.jacobian, (other.simulated - part.simulated) * fit.weights)
    return np.asarray(2 * inverse @ total)


def _bootstrap(fit: Fit, inverse: Array, seed: int) -> Array:
    """Variances (k,) of the linearised estimate over resampled blocks of time."""
    scores, memory = [], 1
    for part in fit.errors:
        assert part.jacobian is not None
        weighted = part.error * fit.weights
        scores.append(np.einsum("tjk,tj->tk", part.jacobian, weighted))
        memory = max([memory, *(correlation_rows(column) for column in part.error.T if column.any())])
    rows = np.concatenate(scores)
    block = int(np.clip(MEMORIES * memory, 2, max(2, LONGEST * len(rows))))
    sums = moving_block_sums(rows - rows.mean(axis=0), block, RESAMPLES, np.random.default_rng(seed))
    return np.asarray(np.var(sums @ inverse, axis=0))


def _partners(total: Array, determined: NDArray[np.bool_]) -> tuple[tuple[int, ...], ...]:
    deviation = np.sqrt(np.diag(total))
    correlation = total / deviation[:, None] / deviation
    found: list[tuple[int, ...]] = []
    for k in range(len(total)):
        near = [m for m in range(len(total)) if m != k and abs(correlation[k, m]) > TOGETHER]
        found.append(tuple(near) if not determined[k] else ())
    return tuple(found)


def intervals(theta: Array, errors: Array, sizes: Array) -> Sequence[tuple[float, float]]:
    """Gives 95 % intervals of parameters in their units."""
    return [
        (float((x - NORMAL_95 * e) * s), float((x + NORMAL_95 * e) * s))
        for x, e, s in zip(theta, errors, sizes, strict=True)
    ]
