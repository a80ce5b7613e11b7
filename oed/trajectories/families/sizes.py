"""The numbers that size a family, checked."""

from __future__ import annotations

import numpy as np

from robots.common.errors import InputError


def check_size(harmonics: int, base_frequency: float) -> None:
    """Checks how many harmonics a family has, and how long it lasts.

    Raises:
        InputError: fewer than two harmonics, or a frequency that is not positive.
    """
    if harmonics < 2 or harmonics != int(harmonics):
        raise InputError(f"harmonics is {harmonics}", allowed="a whole number, at least 2")
    if not (np.isfinite(base_frequency) and base_frequency > 0):
        raise InputError(f"the base frequency is {base_frequency} Hz", allowed="a positive number")
