"""Motion at constant speed: there the errors of an encoder's steps are no noise, but lines, and the speed is known."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robots.common.stretches import spans

Array = NDArray[np.float64]

CRUISE = 0.4
"""Time [s] over which a line of an encoder's steps stays where it is, if the joint is at most one off by then."""

STRAIGHT = 1.5
"""Encoder steps by which the middle of a straight line is off its ends' mean, three times rounded, at most."""


def remove_encoder_lines(q: Array, dq: Array, ddq: Array, counts: Array, step: float) -> tuple[Array, Array]:
    """Takes the lines of encoder steps out of velocities and accelerations (N, n), where joints keep their speed.

    At constant speed the steps fold down to a few frequencies that stay where they are. No spectrum tells those from
    motion, and times a heavy arm's inertia they are torque. Where a position differs by a step or so from a straight
    line over `CRUISE` to either side, its derivatives are those of differences over that time: what they leave out of
    a motion is less than a step.

    Args:
        q: positions (N, n) [rad or m] of one log.
        dq: velocities (N, n).
        ddq: accelerations (N, n).
        counts: each joint's encoder step (n,); zero for none.
        step: sample period [s].

    Returns:
        Velocities and accelerations.
    """
    lag = round(CRUISE / step)
    dq, ddq = dq.copy(), ddq.copy()
    if len(q) <= 2 * lag:
        return dq, ddq
    for j in np.flatnonzero(counts > 0):
        ahead, here, behind = q[2 * lag :, j], q[lag:-lag, j], q[: -2 * lag, j]
        bend = ahead - 2 * here + behind
        for start, stop in spans(np.abs(bend) <= STRAIGHT * counts[j]):
            if stop - start > lag // 4:  # longer than an acceleration takes that changes its sign
                rows = slice(start + lag, stop + lag)
                dq[rows, j] = (ahead - behind)[start:stop] / (2 * lag * step)
                ddq[rows, j] = bend[start:stop] / (lag * step) ** 2
    return dq, ddq
