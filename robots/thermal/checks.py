"""Checks of what goes into a thermal model: friction powers, time steps and ambient temperatures."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array
from robots.common.errors import InputError


def checked_power(power: ArrayLike) -> Array:
    """Gives powers as an array.

    Raises:
        InputError: one is negative or not finite: friction never gives power back.
    """
    W = np.asarray(power, dtype=np.float64)
    if not np.all(np.isfinite(W) & (W >= 0.0)):
        raise InputError("thermal model: a friction power is negative or not finite", allowed="zero or more watts")
    return W


def checked_steps(steps: ArrayLike) -> Array:
    """Gives times as an array.

    Raises:
        InputError: one is negative or not finite.
    """
    h = np.asarray(steps, dtype=np.float64)
    if not np.all(np.isfinite(h) & (h >= 0.0)):
        raise InputError("thermal model: a time step is negative or not finite", allowed="zero or more seconds")
    return h


def checked_ambient(ambient: ArrayLike) -> Array:
    """Gives ambient temperatures as an array [degC].

    Raises:
        InputError: one is not finite.
    """
    around = np.asarray(ambient, dtype=np.float64)
    if not np.isfinite(around).all():
        raise InputError("thermal model: an ambient temperature is not finite", allowed="finite numbers [degC]")
    return around
