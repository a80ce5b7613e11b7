"""Noise of the velocities, and the speeds below which it leaves the sign of the friction open."""

from __future__ import annotations

import numpy as np

from estimation.uncertainty.quantiles import robust_deviation
from robots.common.arrays import Array
from robots.signals import Log, Motion
from robots.terms.friction import STANDING_SPEED

# The sign of the friction is open below so many standard deviations of the noise.
NOISE_SIGMAS = 3.0
# Speed [rad/s or m/s] from which a joint slides: below it friction may be static.
SLIDING = 10 * STANDING_SPEED


def smoothed_noise(log: Log, motion: Motion, cutoff: float) -> Array:
    """Gives the standard deviation (n,) of the noise of velocities from smoothed positions [rad/s or m/s].

    What the smoothing removes is the positions' noise above its cut-off f. White noise of standard deviation s below it
    gives a velocity of s 2 pi sqrt(f^3 / (3 f_N)), with f_N half of the sampling rate.

    Args:
        log: with the positions.
        motion: smoothed, at some of its times.
        cutoff: of the smoothing [Hz].
    """
    nyquist = 0.5 / float(np.median(np.diff(motion.t)))
    passed = min(cutoff, nyquist)
    raw = np.column_stack([np.interp(motion.t, log.t, column) for column in log.q.T])
    removed = robust_deviation(raw - motion.q)
    # A smoothing is taken to remove 5 % of white noise at least: without any, nothing shows how large it is.
    white = removed / np.sqrt(max(1.0 - passed / nyquist, 0.05))
    return np.asarray(white * 2.0 * np.pi * np.sqrt(passed**3 / (3.0 * nyquist)))


def logged_noise(dq: Array) -> Array:
    """Gives the standard deviation (n,) of the white noise of logged velocities (N, n), by their third differences."""
    # The squares of the coefficients 1, 3, 3, 1 add to 20.
    return robust_deviation(np.diff(dq, n=3, axis=0)) / np.sqrt(20.0)


def sliding_speed(noise: Array) -> Array:
    """Gives the speeds (n,) from which a joint surely slides, by the noise of its velocity (n,) [rad/s or m/s]."""
    return np.maximum(SLIDING, NOISE_SIGMAS * noise)
