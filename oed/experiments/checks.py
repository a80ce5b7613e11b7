"""Checks of a design's options and limits before the search."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from oed.retiming import finite_limits
from robots.common.errors import InfeasibleError, InputError
from robots.limits import Limits
from robots.loading import catalogue
from robots.robot import Robot

# The share of its range that a joint must be able to travel in one period for an experiment to be worth its name.
TRAVEL = 0.01


def check_period(limits: Limits, duration: float) -> None:
    """Checks that each joint can move visibly within one period.

    A joint that follows x sin(2 pi t / T) reaches the velocity 2 pi x / T, the acceleration (2 pi / T)^2 x and the jerk
    (2 pi / T)^3 x: the limits bound its travel 2 x.

    Args:
        limits: the joint limits.
        duration: T [s].

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
    if np.isfinite(shortest[joint]) and shortest[joint] > duration:
        raise InfeasibleError(
            (
                f"a period of {duration:.4g} s is too short: within its velocity, acceleration and jerk "
                f"limits the joint covers less than {100 * TRAVEL:g} % of its range"
            ),
            joint=joint + 1,
            allowed=f"{shortest[joint]:.3g} s or longer (base frequency up to {1 / shortest[joint]:.3g} Hz)",
        )


def velocity_share(robot: Robot, stated: float | None) -> float:
    """Gives the share of the velocity limits that motions may use.

    Args:
        robot: the robot; the first motions on one that is not of the catalogue are slower.
        stated: what a user asks for; None for the default.

    Raises:
        InputError: a share out of range.
    """
    if stated is None:
        # Share of the velocity limits that motions use by default on a robot that is not of the catalogue.
        return 1.0 if robot.origin in catalogue() else 0.5
    if not 0.0 < stated <= 1.0:
        raise InputError(f"the velocity fraction is {stated}", allowed="above 0, up to 1")
    return stated


def usable_limits(limits: Limits, velocity_fraction: float = 1.0) -> Limits:
    """Completes infinite acceleration and jerk limits, and keeps a reserve for what happens between the samples.

    Args:
        limits: of the robot.
        velocity_fraction: share of the velocity limits that is used.

    Returns:
        The limits for the samples of a design.

    Raises:
        InfeasibleError: a limit of zero.
        InputError: a joint without a velocity limit.
    """
    # The controller interpolates between the file's samples; a hair of every limit is left to it.
    used = 0.9995
    scaled = finite_limits(limits).scaled(velocity=used * velocity_fraction, acceleration=used, jerk=used, torque=1.0)
    ranges = limits.upper - limits.lower
    narrower = np.where(np.isfinite(ranges), ranges, 0.0) * (1 - used) / 2
    return replace(scaled, lower=scaled.lower + narrower, upper=scaled.upper - narrower)
