"""The level of each joint's friction beside the model's: heat, wear and errors of the fit, followed slowly."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimation.external_forces.residuals.filters import filtered

Array = NDArray[np.float64]

MEMORY = 30.0
"""Time constant of the level [s]: joints heat up in minutes, a push lasts a fraction of a second."""


def friction_excess(t: Array, external: Array, friction: Array, begins: NDArray[np.bool_]) -> Array:
    """Follows the excess s of friction f over the model's, tau_f = (1 + s) f (N, n), by least squares that forgets.

        s_k = -sum_i a^(k-i) u_i f_i / sum_i a^(k-i) f_i^2

    u is the external torque by the model's own friction. It begins with the least squares of the log's first memory.
    What a push adds is its length over the memory; a contact of many seconds is taken for friction in part.

    Args:
        t: times (N,) [s].
        external: u (N, n) [N m or N].
        friction: f of the model (N, n) [N m or N].
        begins: where (N,) the observer begins anew: such samples do not count.

    Returns:
        s at the sample before each (N, n).
    """
    known = np.where(begins[:, None], 0.0, friction)
    clock, once = steady_clock(t), np.zeros(len(t), dtype=bool)
    once[0] = True
    first = clock <= clock[0] + MEMORY
    sums = []
    for product in (-external * known, known**2):
        product[0] = product[first].mean(axis=0)
        sums.append(filtered(product, clock, MEMORY, once))
    excess = np.divide(sums[0], sums[1], out=np.zeros_like(sums[0]), where=sums[1] > 0.0)
    return np.concatenate([excess[:1], excess[:-1]])


def steady_clock(t: Array) -> Array:
    """Gives times (N,) in which a gap lasts two usual steps: one sample must not stand for a pause."""
    steps = np.diff(t)
    return np.concatenate([[0.0], np.cumsum(np.minimum(steps, 2.0 * np.median(steps)))])
