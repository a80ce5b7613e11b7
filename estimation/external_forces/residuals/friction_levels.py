"""The level of each joint's friction beside the model's: heat, wear and errors of the fit, followed slowly."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimation.external_forces.residuals.filters import filtered

Array = NDArray[np.float64]

MEMORY = 30.0
"""Time constant of the level [s]: joints heat up in minutes, a push lasts a fraction of a second."""


def friction_excess(
    t: Array, external: Array, friction: Array, begins: NDArray[np.bool_], weights: Array | None = None
) -> Array:
    """Follows the excess s of friction f over the model's, tau_f = (1 + s) f (N, n), by least squares that forgets.

        s_k = -sum_i a^(k-i) w_i u_i f_i / sum_i a^(k-i) w_i f_i^2

    u is the external torque by the model's own friction. It begins with the least squares of the log's first memory.
    With the weights of `contact_weight` a push adds no more than one at the threshold would. A contact of many seconds
    is taken for friction in part, the later the stronger it is.

    Args:
        t: times (N,) [s].
        external: u (N, n) [N m or N].
        friction: f of the model (N, n) [N m or N].
        begins: where (N,) the observer begins anew: such samples do not count.
        weights: of the samples (N,), one each by default.

    Returns:
        s at the sample before each (N, n).
    """
    known = np.where(begins[:, None], 0.0, friction)
    clock, once = steady_clock(t), np.zeros(len(t), dtype=bool)
    once[0] = True
    first = clock <= clock[0] + MEMORY
    sums, counts = [], np.ones((len(t), 1)) if weights is None else weights[:, None]
    for product in (-counts * external * known, counts * known**2):
        product[0] = product[first].mean(axis=0)
        sums.append(filtered(product, clock, MEMORY, once))
    excess = np.divide(sums[0], sums[1], out=np.zeros_like(sums[0]), where=sums[1] > 0.0)
    return np.concatenate([excess[:1], excess[:-1]])


def contact_weight(statistic: ArrayLike) -> Array:
    """Gives the weight of samples (N,) by their statistic (N,) over the threshold, beyond which it falls (Huber 1981).

    A residual beyond the threshold counts as one in the same direction at the threshold.
    """
    return np.asarray(1.0 / np.sqrt(np.maximum(statistic, 1.0)))


def steady_clock(t: Array) -> Array:
    """Gives times (N,) in which a gap lasts two usual steps: one sample must not stand for a pause."""
    steps = np.diff(t)
    return np.concatenate([[0.0], np.cumsum(np.minimum(steps, 2.0 * np.median(steps)))])
