"""Parameters of an effect: linear coefficients, and shape parameters of its columns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from robots.terms.base import length_unit

if TYPE_CHECKING:
    from robots.robot import Robot

Place = int | None
"""Where an effect acts: a joint, counted from 1, or None for the whole robot."""

STRAIGHT = {
    "rad": "m",
    "rad/s": "m/s",
    "N m": "N",
    "N m/rad": "N/m",
    "kg m2": "kg",
    "periods per turn": "rad/m",
}
"""Unit of a shape parameter on a linear axis, by its unit on a revolute joint."""

DAMPING_RATIO = 0.05
"""Damping ratio of a resonance, unless the data show another one."""


@dataclass(frozen=True)
class Shape:
    """A shape parameter of an effect, in which its columns are not linear.

    Attributes:
        name: such as ``stribeck_velocity``.
        unit: its unit.
        lower: the least value that is physically possible.
        upper: the largest.
        scale: ``log`` if the search steps by factors, ``linear`` if by differences.
        grid: the values of a scan, unless they depend on the data (see `Effect.grid`).
        inexact: standard error of the formula itself, in addition to that of the data. In the parameter's unit, or as
            a fraction of the value on a logarithmic scale.
        default: the value if a description does not state it; None if it must be stated.
        beside: whether it is optional. It is then searched after the others, and counts only if it is not the default.
        choices: the only possible values, if they are few; `Effect.likely` lists them, and no others are searched.
    """

    name: str
    unit: str
    lower: float
    upper: float
    scale: Literal["log", "linear"] = "log"
    grid: tuple[float, ...] = ()
    inexact: float = 0.0
    default: float | None = None
    beside: bool = False
    choices: tuple[float, ...] = ()

    @property
    def moment(self) -> bool:
        """Whether the parameter is a time on the logs' clock, not a duration."""
        return self.unit == "s" and self.lower == -np.inf

    def is_left(self, value: float) -> bool:
        """Returns whether a value means that the optional parameter is unused."""
        return self.beside and value == self.default

    def unit_at(self, robot: Robot, joint: Place) -> str:
        """Returns the parameter's unit at a joint, which differs on a linear axis."""
        straight = joint is not None and length_unit(robot, joint - 1) == "m"
        return STRAIGHT.get(self.unit, self.unit) if straight else self.unit


@dataclass(frozen=True)
class Coefficient:
    """A parameter in which an effect's torque is linear.

    Attributes:
        name: such as ``stribeck_torque``.
        unit: its unit; the column is torque or force per this unit.
        lower: the least value that is physically possible.
        upper: the largest.
        inexact: standard error of the formula itself, in addition to that of the data, as a fraction of the value.
        least: size below which it counts as zero, because errors of the formula are as large.
    """

    name: str
    unit: str
    lower: float = -np.inf
    upper: float = np.inf
    inexact: float = 0.0
    least: float = 0.0
