"""Interface of a drive's members: delay, control law, motor and gear, one after the other from command to joint."""

from __future__ import annotations

from abc import ABC
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import casadi
import numpy as np

from robots.terms.effect_bases.parameters import STRAIGHT

if TYPE_CHECKING:
    from robots.robot import Robot

Values = Mapping[str, casadi.SX]


@dataclass(frozen=True, kw_only=True)
class DriveParameter:
    """One number of a drive.

    Attributes:
        name: such as ``armature``.
        unit: its unit on a revolute joint.
        default: its value where nobody states one.
        lower: the least value that is physically possible.
        upper: the largest.
        size: a usual size, by which a fit scales it.
    """

    name: str
    unit: str
    default: float = 0.0
    lower: float = 0.0
    upper: float = np.inf
    size: float = 1.0

    def unit_at(self, robot: Robot, joint: int) -> str:
        """Returns the parameter's unit at a joint, counted from 0, which differs on a linear axis."""
        if robot.chain.joints[joint].kind == "revolute":
            return self.unit
        return {"N m s/rad": "N s/m", **STRAIGHT}.get(self.unit, self.unit)


class Instant(NamedTuple):
    """Symbolic state of one joint.

    Attributes:
        robot: the robot.
        joint: the joint, counted from 0.
        measured: position by the encoder [rad or m].
        measured_rate: its derivative [rad/s or m/s].
        dq: velocity [rad/s or m/s].
        ddq: acceleration [rad/s2 or m/s2].
        load: torque of the rigid body on the gear [N m or N].
        state: the members' own states, such as the integral of a velocity error.
        twist: position of the motor less that of the link, at the joint [rad or m]; zero without an elastic gear.
        twist_rate: its derivative [rad/s or m/s].
    """

    robot: Robot
    joint: int
    measured: casadi.SX
    measured_rate: casadi.SX
    dq: casadi.SX
    ddq: casadi.SX
    load: casadi.SX
    state: Values
    twist: casadi.SX
    twist_rate: casadi.SX


class Member(ABC):
    """One part of a drive, which transmits a signal: a command [rad or m] before the law, a torque [N m] after it."""

    name: ClassVar[str]
    title: ClassVar[str]
    states: ClassVar[tuple[str, ...]] = ()
    parts: ClassVar[bool] = False
    """Whether the member parts the joint into a motor before it and a link after it, which move by themselves."""

    def parameters(self) -> tuple[DriveParameter, ...]:
        """Describes the member's numbers."""
        return ()

    def transmit(self, signal: casadi.SX, now: Instant, values: Values) -> casadi.SX:
        """Builds what leaves the member.

        Args:
            signal: what enters it.
            now: state of the joint.
            values: the drive's parameters by name.
        """
        return signal

    def rates(self, signal: casadi.SX, now: Instant, values: Values) -> dict[str, casadi.SX]:
        """Builds the time derivatives of the member's own states, from the signal that enters it."""
        return {}

    def dry(self, now: Instant, values: Values) -> casadi.SX:
        """Builds the size of dry friction [N m or N], which acts against the velocity, or holds the joint."""
        return casadi.SX(0)

    def steps(self) -> float:
        """Returns the resolution of the command [rad or m]; 0 for a continuous one."""
        return 0.0
