"""What all kinds of geometric errors have in common: parameters, and how each moves the frames of the joints."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from robots.common.arrays import Array
from robots.geometry_errors.state import ArmState
from robots.robot import Robot


@dataclass(frozen=True, kw_only=True)
class ErrorParameter:
    """One parameter of a geometric error.

    Attributes:
        name: unique within a model, such as "zero_3".
        kind: of the error, such as "joint_zero".
        joint: that it belongs to, from 1; None for the whole arm or the measurement.
        unit: in SI.
        scale: its usual size in this unit; columns are scaled by it before ranks are judged.
        shown: the unit for people, and how many of them are one in SI.
    """

    name: str
    kind: str
    joint: int | None
    unit: str
    scale: float
    shown: tuple[str, float] = ("", 1.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Column:
    """How one unit of a parameter moves joint frames.

    Attributes:
        parameter: what it is of.
        twists: joint, from 0, and the twist of its frame (N, 6), or (1, 6) if it is the same at all poses.
    """

    parameter: ErrorParameter
    twists: tuple[tuple[int, Array], ...]


class ErrorTerm(ABC):
    """A kind of geometric errors: the frame of joint i moves by ``exp(sum of value * twist)`` before the joint turns.

    Attributes:
        kind: its name in files.
        title: its name for people.
        constant: whether the twists are the same at all poses, so that a URDF can state it.
        of_link: whether it moves the frame before all other kinds do, which then act in the axes of the moved frame.
        includes: kinds that this one contains, and that are fitted with it.
    """

    kind: ClassVar[str]
    title: ClassVar[str]
    constant: ClassVar[bool] = False
    of_link: ClassVar[bool] = False
    includes: ClassVar[tuple[str, ...]] = ()

    @abstractmethod
    def parameters(self, robot: Robot, state: ArmState) -> tuple[ErrorParameter, ...]:
        """Lists the parameters of a robot, at these poses."""

    @abstractmethod
    def columns(self, robot: Robot, state: ArmState) -> tuple[Column, ...]:
        """Gives the column of each parameter at some poses."""

    def missing(self, robot: Robot, state: ArmState) -> str:
        """Says what the poses or the robot lack for this kind; empty if nothing."""
        return ""


def along_axis(robot: Robot, joint: int, displacement: Array) -> Array:
    """Twist (N, 6) of a joint frame that is moved along the joint's own axis.

    Args:
        robot: the robot.
        joint: from 0.
        displacement: (N,) [rad or m].
    """
    axis, prismatic = robot.chain.joints[joint].axis, robot.chain.kinds[joint] == "prismatic"
    # Expressions are objects to numpy.
    twist = np.zeros((len(displacement), 6), dtype=displacement.dtype)
    twist[:, slice(0, 3) if prismatic else slice(3, 6)] = displacement[:, None] * axis
    return twist


def joint_unit(robot: Robot, joint: int) -> str:
    """Unit of a joint, from 0: rad or m."""
    return "m" if robot.chain.kinds[joint] == "prismatic" else "rad"


def shown_unit(unit: str) -> tuple[str, float]:
    """Unit for people, and how many of them are one in SI."""
    milli = {"m": "mm", "rad": "mrad"}
    micro = {"rad/(N m)": "urad/(N m)", "m/N": "um/N", "1/K": "1e-6/K", "1": "1e-6"}
    if unit in milli:
        return milli[unit], 1e3
    return (micro[unit], 1e6) if unit in micro else (unit, 1.0)


def parameter(name: str, kind: str, joint: int | None, unit: str, scale: float) -> ErrorParameter:
    """Makes a parameter; joints are counted from 0 here, and from 1 in its name and `joint`."""
    number = None if joint is None else joint + 1
    return ErrorParameter(name=name, kind=kind, joint=number, unit=unit, scale=scale, shown=shown_unit(unit))


def one_each(
    robot: Robot, parameters: Sequence[ErrorParameter], displacements: Array, joints: Sequence[int]
) -> tuple[Column, ...]:
    """Columns of parameters that move one joint each along its axis.

    Args:
        robot: the robot.
        parameters: K of them.
        displacements: (N, K) per unit of the parameter.
        joints: of the parameters, from 0.
    """
    return tuple(
        Column(parameter=item, twists=((joint, along_axis(robot, joint, displacements[:, k])),))
        for k, (item, joint) in enumerate(zip(parameters, joints, strict=True))
    )
