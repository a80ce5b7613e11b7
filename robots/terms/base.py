"""Interface of the terms of a torque model."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi
import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from robots.robot import Robot


@dataclass(frozen=True, kw_only=True)
class Column:
    """One column of the regressor, which belongs to one parameter.

    Attributes:
        name: the parameter's name, unique in a model, such as ``mPx_2``.
        symbol: the name without the joint, such as ``mPx``.
        joint: the parameter's joint or link, counted from 1.
        unit: its unit, such as ``kg m``.
        term: the name of its term.
        friction: whether it is friction: a torque by the joint's velocity alone.
    """

    name: str
    symbol: str
    joint: int
    unit: str
    term: str
    friction: bool = False

    @property
    def is_coulomb(self) -> bool:
        """Whether it is the coefficient of the velocity's sign in a joint's friction."""
        return self.friction and self.symbol == "f1"


class Term(ABC):
    """A physical effect whose torque is linear in its parameters: tau = Y(q, dq, ddq) pi."""

    name: str

    @abstractmethod
    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Describes the k parameters, in the order of the regressor's columns."""

    @abstractmethod
    def regressor(self, robot: Robot, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX) -> casadi.SX:
        """Builds the symbolic regressor Y.

        Args:
            robot: the robot with n joints.
            q: joint positions (n,) [rad or m].
            dq: joint velocities (n,) [rad/s or m/s].
            ddq: joint accelerations (n,) [rad/s2 or m/s2].

        Returns:
            Y (n, k): generalised force [N m or N] per unit of each parameter.
        """

    @abstractmethod
    def nominal(self, robot: Robot) -> NDArray[np.float64]:
        """Returns the robot description's value of each parameter (k,), NaN where it states none."""


def force_unit(robot: Robot, joint: int) -> str:
    """Returns the unit of a joint's generalised force; `joint` counts from 0."""
    return "N m" if robot.chain.joints[joint].kind == "revolute" else "N"


def length_unit(robot: Robot, joint: int) -> str:
    """Returns the unit of a joint's position; `joint` counts from 0."""
    return "rad" if robot.chain.joints[joint].kind == "revolute" else "m"


def joint_columns(robot: Robot, term: str, symbol: str, units: list[str]) -> tuple[Column, ...]:
    """Describes one parameter per joint.

    Args:
        robot: the robot with n joints.
        term: the name of the term.
        symbol: the parameter's name without the joint.
        units: its unit on each joint (n,).
    """
    return tuple(
        Column(name=f"{symbol}_{joint}", symbol=symbol, joint=joint, unit=units[joint - 1], term=term)
        for joint in range(1, robot.n + 1)
    )
