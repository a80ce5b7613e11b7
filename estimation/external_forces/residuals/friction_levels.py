"""The level of each joint's friction beside the model's: heat, wear and errors of the fit, followed slowly."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimation.external_forces.residuals.filters import filtered
from robots.common.arrays import Array

FRICTION_MEMORY = 30.0
"""Time constant of the level [s]: joints heat up in minutes, a push lasts a fraction of a second."""


def friction_excess(
    t: Array,
    external: Array,
    friction: Array,
    begins: NDArray[np.bool_],
    weights: Array | None = None,
    slides: NDArray[np.bool_] | None = None,
) -> Array:
    """Follows the excess s of friction f over the model's, tau_f = (1 + s) f (N, n), by least squares that forgets.

        s_k = -sum_i a^(k-i) w_i u_i f_i / sum_i a^(k-i) w_i f_i^2

    u is the external torque by the model's own friction. It begins with the least squares of the log's first memory.
    With the weights of `contact_weight` a push adds no more than one at the threshold would. A contact of many seconds
    is taken for friction in part, the later the stronger it is. While a joint does not slide, its level stays and time
    does not count: static friction does not show the sliding one, and the sign of the model's is then that of noise.

    Args:
        t: times (N,) [s].
        external: u (N, n) [N m or N].
        friction: f of the model (N, n) [N m or N].
        begins: where (N,) the observer begins anew: such samples do not count.
        weights: of the samples (N,), one each by default.
        slides: where (N, n) the joints slide, everywhere by default.

    Returns:
        s at the sample before each (N, n).
    """
    excess = np.zeros_like(external)
    steps = np.diff(steady_clock(t), prepend=0.0)
    counts = np.ones(len(t)) if weights is None else weights
    for j in range(external.shape[1]):
        used = ~begins if slides is None else ~begins & slides[:, j]
        rows = np.flatnonzero(used)
        if not len(rows):
            continue
        own = _followed(steps[rows], counts[rows], external[rows, j], friction[rows, j])
        latest = np.cumsum(used) - 1
        excess[:, j] = own[np.maximum(latest, 0)]
    return np.concatenate([excess[:1], excess[:-1]])


def _followed(steps: Array, counts: Array, external: Array, friction: Array) -> Array:
    """The excess (M,) at the rows of one joint that count, `steps` [s] after each other."""
    clock, once = np.cumsum(steps) - steps[0], np.zeros(len(steps), dtype=bool)
    once[0] = True
    first = clock <= FRICTION_MEMORY
    sums = []
    for product in (-counts * external * friction, counts * friction**2):
        product[0] = product[first].mean()
        sums.append(filtered(product[:, None], clock, FRICTION_MEMORY, once)[:, 0])
    return np.divide(sums[0], sums[1], out=np.zeros_like(sums[0]), where=sums[1] > 0.0)


def contact_weight(statistic: ArrayLike) -> Array:
    """Gives the weight of samples (N,) by their statistic (N,) over the threshold, beyond which it falls (Huber 1981).

    A residual beyond the threshold counts as one in the same direction at the threshold.
    """
    return np.asarray(1.0 / np.sqrt(np.maximum(statistic, 1.0)))


def steady_clock(t: Array) -> Array:
    """Gives times (N,) in which a gap lasts two usual steps: one sample must not stand for a pause."""
    steps = np.diff(t)
    return np.concatenate([[0.0], np.cumsum(np.minimum(steps, 2.0 * np.median(steps)))])
