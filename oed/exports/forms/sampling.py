"""A trajectory at another period."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BPoly

from robots.common.errors import InputError
from robots.signals import Motion

MOST_SAMPLES = 5_000_000
"""Samples of an exported trajectory, at most."""


def at_cycle(motion: Motion, cycle: float) -> Motion:
    """Samples a motion at the cycle of a controller, unless its period is a multiple of it.

    Args:
        motion: the trajectory.
        cycle: of the controller [s].

    Raises:
        InputError: see `at_period`.
    """
    period = motion.period
    whole = 0.0 if period is None else round(period / cycle)
    fits = period is not None and whole >= 1 and abs(period - whole * cycle) < 1e-6 * cycle
    return motion if fits else at_period(motion, cycle)


def at_period(motion: Motion, period: float) -> Motion:
    """Samples a motion at another period.

    Between two samples positions are the polynomial of degree 5 that has positions, velocities and accelerations of
    both. The end is reached exactly: the last sample is repeated if the duration is no multiple of the period.

    Args:
        motion: the trajectory; its time begins at zero afterwards.
        period: sample period [s].

    Raises:
        InputError: a period that is not positive, or too many samples.
    """
    if not 0 < period < float("inf"):
        raise InputError(f"a period of {period} s", allowed="above 0")
    count = int(np.ceil(motion.duration / period - 1e-6)) + 1
    if count > MOST_SAMPLES:
        raise InputError(f"{count} samples at a period of {period:g} s", allowed=f"up to {MOST_SAMPLES}")
    t = motion.t - motion.t[0]
    times: NDArray[np.float64] = period * np.arange(count, dtype=np.float64)
    own = motion.period
    if own is not None and abs(own - period) < 1e-9 * own:
        return Motion(times[: len(motion)], motion.q, motion.dq, motion.ddq)
    curve = BPoly.from_derivatives(t, np.stack([motion.q, motion.dq, motion.ddq], axis=1))
    inside = np.minimum(times, t[-1])
    q, dq, ddq = (np.asarray(part(inside)) for part in (curve, curve.derivative(1), curve.derivative(2)))
    if times[-1] > t[-1] + 1e-9:
        # Beyond its end the motion rests.
        dq[-1] = ddq[-1] = 0.0
    return Motion(times, q, dq, ddq)
