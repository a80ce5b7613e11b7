"""What programs of industrial controllers share: axes, names, arrays, and points for the controller's own spline."""

from __future__ import annotations

import re
import warnings
from collections.abc import Collection
from importlib.resources import files

import numpy as np
from scipy.interpolate import CubicSpline

from oed.exports.forms.base import Array
from oed.exports.forms.sampling import at_period
from robots.common.errors import AssumedValueWarning, InputError
from robots.joints.controller_axes import axes_of
from robots.robot import Robot
from robots.signals import Motion

LONGEST_ARRAY = 32_767
"""Elements of an array, at most."""

SPACINGS = (0.2, 0.16, 0.12, 0.1, 0.08, 0.06, 0.05, 0.04)
"""Times between points of a spline [s]; shorter pieces make controllers slow down."""


def require_name(name: str, most: int, reserved: Collection[str], language: str) -> None:
    """Refuses a name that a program or module of a language cannot have.

    Raises:
        InputError: a reserved word, a name that is too long, or one that does not begin with a letter.
    """
    if len(name) > most:
        raise InputError(f"the name {name!r} has {len(name)} characters", allowed=f"up to {most} in {language}")
    if not re.fullmatch(r"[A-Za-z]\w*", name, re.ASCII):
        raise InputError(f"the name {name!r}", allowed=f"a letter, then letters, digits and _, in {language}")
    if name.upper() in reserved:
        raise InputError(f"the name {name!r} is a reserved word of {language}", remedy="choose another --name")


def reserved_words(file: str) -> frozenset[str]:
    """Reads the words that a language keeps for itself, and those that our programs use, in capitals."""
    return frozenset((files("oed.exports.forms.programs") / file).read_text("ascii").split())


def axes_in_degrees(q: Array, robot: Robot) -> Array:
    """Gives the axes of the controller at joint positions (N, n) [deg].

    Warns:
        AssumedValueWarning: the robot's description does not say how the controller counts them.
    """
    if robot.axes is None:
        text = (
            f"{robot.name}: signs, zeros and couplings of the controller's axes are not stated (controller_axes in a "
            "robot YAML): the axes are taken as the joints of the description. Compare both at two poses first"
        )
        warnings.warn(AssumedValueWarning(text), stacklevel=5)
    return axes_of(robot.axes, q)


def spline_points(motion: Motion) -> tuple[Motion, float]:
    """Chooses points through which a cubic spline follows a motion, as few as `SPACINGS` allow.

    Args:
        motion: at rest at both ends.

    Returns:
        The points, evenly spaced, and the largest distance of the spline from the motion [rad].
    """
    chosen, error = motion, 0.0
    for spacing in SPACINGS:
        chosen = at_period(motion, min(spacing, motion.duration))
        spline = CubicSpline(chosen.t, chosen.q, bc_type="clamped")
        error = float(np.abs(spline(motion.t - motion.t[0]) - motion.q).max())
        # A spline through the points leaves the trajectory by no more than this, if a spacing allows it [rad].
        if error <= 1e-3:
            break
    return chosen, error


def pieces(count: int) -> list[slice]:
    """Cuts a list into arrays that a controller takes."""
    return [slice(first, min(first + LONGEST_ARRAY, count)) for first in range(0, count, LONGEST_ARRAY)]
