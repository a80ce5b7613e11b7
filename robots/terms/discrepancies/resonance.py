"""Response of a lightly damped oscillator to an excitation."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from robots.common.arrays import Array
from robots.terms.effect_bases.parameters import DAMPING_RATIO
from robots.terms.effects import Situation


def resonance(situation: Situation, drive: Array, frequency: float) -> tuple[Array, Array]:
    """Solves x'' + 2 d w x' + w^2 x = u by the bilinear rule, from rest at the start of each log.

    Args:
        situation: the motion (N samples).
        drive: the excitation u (N, ...).
        frequency: w / 2 pi [Hz].

    Returns:
        w^2 x and w x' (N, ...), each in the unit of u.
    """
    omega = 2 * np.pi * frequency
    k = 2 / max(situation.period, 1e-9)
    den = np.array([k**2, -2 * k**2, k**2]) + omega**2 * np.array([1.0, 2.0, 1.0])
    # A factor of about two in the damping hardly matters, because the two outputs can combine to another damping.
    den += 2 * DAMPING_RATIO * omega * k * np.array([1.0, 0.0, -1.0])
    place, rate = np.zeros_like(drive), np.zeros_like(drive)
    for run in situation.runs:
        place[run] = lfilter(omega**2 * np.array([1.0, 2.0, 1.0]), den, drive[run], axis=0)
        rate[run] = lfilter(omega * k * np.array([1.0, 0.0, -1.0]), den, drive[run], axis=0)
    return place, rate
