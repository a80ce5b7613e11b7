"""A lightly damped mass on a spring that something drives: how what was set in motion goes on ringing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from robots.terms.effects import Situation

Array = NDArray[np.float64]

# The damping ratio is known only to a factor of about two, because both phases have a column.
DAMPING = 0.05


def resonance(situation: Situation, drive: Array, frequency: float) -> tuple[Array, Array]:
    """Gives w^2 x and w x' (N, ...) of x'' + 2 d w x' + w^2 x = u, by the bilinear rule, at rest before each log.

    Args:
        situation: what the robot did (N samples).
        drive: u (N, ...).
        frequency: w / 2 pi [Hz].
    """
    omega = 2 * np.pi * frequency
    k = 2 / max(situation.period, 1e-9)
    den = np.array([k**2, -2 * k**2, k**2]) + omega**2 * np.array([1.0, 2.0, 1.0])
    den += 2 * DAMPING * omega * k * np.array([1.0, 0.0, -1.0])
    place, rate = np.zeros_like(drive), np.zeros_like(drive)
    for run in situation.runs:
        place[run] = lfilter(omega**2 * np.array([1.0, 2.0, 1.0]), den, drive[run], axis=0)
        rate[run] = lfilter(omega * k * np.array([1.0, 0.0, -1.0]), den, drive[run], axis=0)
    return place, rate
