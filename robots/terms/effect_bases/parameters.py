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
"""Units of shape parameters on a linear axis."""


@dataclass(frozen=True)
class Shape:
    """A parameter that shapes an effect's columns, and that they are not linear in.

    Attributes:
        name: such as ``stribeck_velocity``.
        unit: its unit.
        lower: the least value that is physically possible.
        upper: the largest.
        scale: ``log`` where values differ by factors, ``linear`` where by steps.
        grid: the values that a scan tries where the data give none (see `Effect.grid`).
        inexact: standard error that the formula itself has, beside that of the data: no change is quite sudden, no push
            has quite that form. In the parameter's unit; a share of the value on a logarithmic scale.
        default: what it is where a description does not say; None where it must be said.
        beside: whether the effect is whole without it: it is sought once the others are found, and is one of its
            parameters only where it is not the default.
        choices: the only values that machines have, where these are few: `likely` lists them, and nothing between is
            searched.
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
        """Whether it is a moment of the logs' clock."""
        return self.unit == "s" and self.lower == -np.inf

    def is_left(self, value: float) -> bool:
        """Whether a value says that the effect is whole without it."""
        return self.beside and value == self.default

    def unit_at(self, robot: Robot, joint: Place) -> str:
        """Gives its unit where the effect acts: that of a linear axis' positions and forces on one."""
        straight = joint is not None and length_unit(robot, joint - 1) == "m"
        return STRAIGHT.get(self.unit, self.unit) if straight else self.unit


@dataclass(frozen=True)
class Coefficient:
    """A parameter that an effect's torque is linear in.

    Attributes:
        name: such as ``stribeck_torque``.
        unit: its unit, in which the column is N m (or N) per one.
        lower: the least value that is physically possible.
        upper: the largest.
        inexact: standard error that the formula itself has, beside that of the data, as a share of the value.
        least: size below which it is none: what another effect's formula leaves, or its own cannot tell.
    """

    name: str
    unit: str
    lower: float = -np.inf
    upper: float = np.inf
    inexact: float = 0.0
    least: float = 0.0
