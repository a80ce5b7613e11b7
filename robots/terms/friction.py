"""Joint friction as a polynomial of the velocity (thesis eq. 35)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi
import numpy as np
from numpy.typing import NDArray

from robots.common.errors import InputError
from robots.terms.base import Column, Term, force_unit, joint_columns, length_unit

if TYPE_CHECKING:
    from robots.robot import Robot

COULOMB_VISCOUS = (1, 2)
POLYNOMIAL = (1, 2, 3, 4)


@dataclass(frozen=True)
class FrictionPolynomial(Term):
    """tau_f = f1 sign(dq) + f2 dq + f3 dq |dq| + f4 dq^3, on each joint.

    Attributes:
        powers: which of f1..f4 are there: (1, 2) is Coulomb and viscous friction.
        velocity_scale: v0 [rad/s or m/s], one for all joints or one each. With v0 > 0, sign(dq) is replaced by tanh(dq
            / v0). This is differentiable, as a design needs, and suits a log whose velocity is known to v0 only.
    """

    powers: tuple[int, ...] = POLYNOMIAL
    velocity_scale: float | tuple[float, ...] = 0.0
    name: str = "friction"

    def __post_init__(self) -> None:
        """Checks the powers and the scale.

        Raises:
            InputError: an unknown or repeated power, or a negative scale.
        """
        known = all(power in POLYNOMIAL for power in self.powers)
        if not self.powers or not known or len(set(self.powers)) < len(self.powers):
            raise InputError(f"friction powers {self.powers}", allowed="some of 1, 2, 3, 4, each once")
        if not np.all(np.asarray(self.velocity_scale) >= 0):
            raise InputError(f"friction velocity scale {self.velocity_scale}", allowed="zero or a positive number")

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Describes f1.. of joint 1, then of joint 2, and so on."""
        columns = []
        for power in self.powers:
            units = [_unit(robot, joint, power) for joint in range(robot.n)]
            columns.append(joint_columns(robot, self.name, f"f{power}", units))
        return tuple(of_power[joint] for joint in range(robot.n) for of_power in columns)

    def regressor(self, robot: Robot, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX) -> casadi.SX:
        """Builds Y (n, k n), block diagonal.

        Raises:
            InputError: velocity scales for another number of joints.
        """
        scales = self.velocity_scale if isinstance(self.velocity_scale, tuple) else (self.velocity_scale,) * robot.n
        if len(scales) != robot.n:
            raise InputError(f"{len(scales)} friction velocity scales", allowed=f"one, or {robot.n}")
        return casadi.diagcat(*(self._row(dq[joint], scale) for joint, scale in enumerate(scales)))

    def _row(self, dq: casadi.SX, scale: float) -> casadi.SX:
        sign = casadi.tanh(dq / scale) if scale else casadi.sign(dq)
        shapes = {1: sign, 2: dq, 3: dq * casadi.fabs(dq), 4: dq**3}
        return casadi.horzcat(*(shapes[power] for power in self.powers))

    def nominal(self, robot: Robot) -> NDArray[np.float64]:
        """Gives the described coefficients (k n,)."""
        indices = [power - 1 for power in self.powers]
        return np.asarray(robot.friction, dtype=float)[:, indices].reshape(-1)


def _unit(robot: Robot, joint: int, power: int) -> str:
    force, length = force_unit(robot, joint), length_unit(robot, joint)
    return {1: force, 2: f"{force} s/{length}", 3: f"{force} s2/{length}2", 4: f"{force} s3/{length}3"}[power]
