"""A motion as a smooth curve through its own samples, with their velocities and accelerations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from robots.signals import Motion

Array = NDArray[np.float64]


def hermite_curve(motion: Motion) -> PPoly:
    """Lays polynomials of fifth order through all samples: position, velocity and acceleration are met exactly.

    Args:
        motion: N >= 2 samples of n joints.

    Returns:
        q(s), s = t - t[0] from 0 to the duration, with n columns and continuous second derivatives.
    """
    h = np.diff(motion.t)[:, None]
    q, dq, ddq = motion.q, motion.dq, motion.ddq
    c0, c1, c2 = q[:-1], dq[:-1], ddq[:-1] / 2
    # The remainder of the first three terms at the end of each step.
    rest = (q[1:] - (c0 + h * (c1 + h * c2))) / h**3
    slope = (dq[1:] - (c1 + 2 * h * c2)) / h**2
    bend = (ddq[1:] - 2 * c2) / h
    c3 = 10 * rest - 4 * slope + bend / 2
    c4 = (-15 * rest + 7 * slope - bend) / h
    c5 = (6 * rest - 3 * slope + bend / 2) / h**2
    return PPoly(np.stack([c5, c4, c3, c2, c1, c0]), motion.t - motion.t[0])
