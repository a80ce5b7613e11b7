"""Checks of a design's options and limits before the search."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from oed.retiming import finite_limits
from robots.common.errors import InfeasibleError, InputError
from robots.limits import Limits

# The controller interpolates between the file's samples; a hair of every limit is left to it.
RESERVE = 0.9995
# The share of its range that a joint must be able to travel in one period for an experiment to be worth its name.
TRAVEL = 0.01


def check_options(
    harmonics: int, base_frequency: float, periods: int, velocity_fraction: float, time_limit: float, seed: int
) -> None:
    """Checks the numbers among the options of `oed.design`.

    Raises:
        InputError: naming the option, its value, and what is allowed.
    """
    for name, value, least in (("harmonics", harmonics, 2), ("periods", periods, 1), ("seed", seed, 0)):
        if value < least or value != int(value):
            raise InputError(f"{name} is {value}", allowed=f"a whole number, at least {least}")
    if not (np.isfinite(base_frequency) and base_frequency > 0):
        raise InputError(f"the base frequency is {base_frequency} Hz", allowed="a positive number")
    if not 0 < velocity_fraction <= 1:
        raise InputError(f"the velocity fraction is {velocity_fraction}", allowed="above 0, up to 1")
    if not time_limit > 0:
        raise InputError(f"the time limit is {time_limit} s", allowed="a positive number")


def check_period(limits: Limits, base_frequency: float) -> None:
    """Checks that each joint can move visibly within one period.

    A joint that follows x sin(2 pi t / T) reaches the velocity 2 pi x / T, the acceleration (2 pi / T)^2 x and the jerk
    (2 pi / T)^3 x: the limits bound its travel 2 x.

    Args:
        limits: the joint limits.
        base_frequency: 1 / T [Hz].

    Raises:
        InfeasibleError: a period too short for a joint, with the shortest that would do.
    """
    ranges = limits.upper - limits.lower
    travel = TRAVEL * np.where(np.isfinite(ranges), ranges, 2 * np.pi) / 2
    bounds = (limits.velocity, limits.acceleration, limits.jerk)
    with np.errstate(divide="ignore"):
        shortest = np.max(
            [2 * np.pi * (travel / bound) ** (1 / order) for order, bound in enumerate(bounds, 1)], axis=0
        )
    joint = int(np.argmax(shortest))
    if np.isfinite(shortest[joint]) and shortest[joint] > 1 / base_frequency:
        raise InfeasibleError(
            (
                f"a period of {1 / base_frequency:.4g} s is too short: within its velocity, acceleration and jerk "
                f"limits the joint covers less than {100 * TRAVEL:g} % of its range"
            ),
            joint=joint + 1,
            allowed=f"{shortest[joint]:.3g} s or longer (base frequency up to {1 / shortest[joint]:.3g} Hz)",
        )


def usable_limits(limits: Limits, velocity_fraction: float = 1.0) -> Limits:
    """Completes infinite acceleration and jerk limits, and keeps a reserve for what happens between the samples.

    Raises:
        InfeasibleError: a limit of zero.
        InputError: a joint without a velocity limit.
    """
    scaled = finite_limits(limits).scaled(
        velocity=RESERVE * velocity_fraction, acceleration=RESERVE, jerk=RESERVE, torque=1.0
    )
    ranges = limits.upper - limits.lower
    narrower = np.where(np.isfinite(ranges), ranges, 0.0) * (1 - RESERVE) / 2
    return replace(scaled, lower=scaled.lower + narrower, upper=scaled.upper - narrower)
