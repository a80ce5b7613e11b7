"""Removal of the spectral lines that encoder steps cause at constant speed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robots.common.stretches import spans

Array = NDArray[np.float64]

CRUISE = 0.4
"""Time [s] before and after a row for which the speed must be constant."""

STRAIGHT = 1.5
"""Second difference of the position over `CRUISE` [encoder steps] up to which the speed counts as constant."""


def remove_encoder_lines(q: Array, dq: Array, ddq: Array, counts: Array, step: float) -> tuple[Array, Array]:
    """Removes the spectral lines of encoder steps from velocities and accelerations (N, n) at constant speed.

    At constant speed, encoder steps alias to a few fixed frequencies. A spectrum cannot separate these lines from
    motion. Times the inertia of a heavy arm they are a large torque. Where the second difference of the position over
    `CRUISE` is at most `STRAIGHT` encoder steps, derivatives are therefore replaced by differences over `CRUISE`. These
    neglect less motion than one encoder step.

    Args:
        q: positions (N, n) [rad or m] of one log.
        dq: velocities (N, n) [rad/s or m/s].
        ddq: accelerations (N, n) [rad/s2 or m/s2].
        counts: encoder step of each joint (n,) [rad or m]; zero if it shows none.
        step: sample period [s].

    Returns:
        Velocities and accelerations (N, n).
    """
    lag = round(CRUISE / step)
    dq, ddq = dq.copy(), ddq.copy()
    if len(q) <= 2 * lag:
        return dq, ddq
    for j in np.flatnonzero(counts > 0):
        ahead, here, behind = q[2 * lag :, j], q[lag:-lag, j], q[: -2 * lag, j]
        bend = ahead - 2 * here + behind
        for start, stop in spans(np.abs(bend) <= STRAIGHT * counts[j]):
            if stop - start > lag // 4:  # shorter stretches are zero crossings of the acceleration
                rows = slice(start + lag, stop + lag)
                dq[rows, j] = (ahead - behind)[start:stop] / (2 * lag * step)
                ddq[rows, j] = bend[start:stop] / (lag * step) ** 2
    return dq, ddq
