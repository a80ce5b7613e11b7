"""Joint friction: what a friction term is, and the polynomial of the velocity (thesis eq. 35)."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi
import numpy as np
from numpy.typing import NDArray

from robots.common.errors import InputError
from robots.terms.base import Column, Term, force_unit, length_unit

if TYPE_CHECKING:
    from robots.robot import Robot

COULOMB_VISCOUS = (1, 2)
POLYNOMIAL = (1, 2, 3, 4)


@dataclass(frozen=True, kw_only=True)
class FrictionTerm(Term):
    """Friction of each joint by its own velocity: tau_j = row(dq_j) pi_j, alike on all joints.

    A member is a frozen dataclass that gives `name`, `units`, `row` and, where a description states values, `nominal`.

    Attributes:
        velocity_scale: with a value v0 > 0 [rad/s or m/s], sign(dq) is tanh(dq / v0): differentiable, as a design
            needs it, and finite in slope where a log's velocity is known to v0 only. With 0 it is the sign. One for
            all joints, or one each.

    Raises:
        InputError: a negative scale.
    """

    velocity_scale: float | tuple[float, ...] = 0.0

    def __post_init__(self) -> None:
        if not np.all(np.asarray(self.velocity_scale) >= 0):
            raise InputError(f"friction velocity scale {self.velocity_scale}", allowed="zero or a positive number")

    @abstractmethod
    def units(self, force: str, length: str) -> dict[str, str]:
        """Gives the unit of each parameter of one joint, by its symbol, in the order of the columns.

        Args:
            force: of the joint, ``N m`` or ``N``.
            length: of its position, ``rad`` or ``m``.
        """

    @abstractmethod
    def row(self, dq: casadi.SX, sign: casadi.SX, scale: float) -> casadi.SX:
        """Builds the columns (1, k) of one joint.

        Args:
            dq: its velocity.
            sign: sign(dq), smoothed to `velocity_scale`.
            scale: that scale of this joint; 0 where the sign is sharp.
        """

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Describes the parameters of joint 1, then of joint 2, and so on."""
        return tuple(
            Column(name=f"{symbol}_{joint + 1}", symbol=symbol, joint=joint + 1, unit=unit, term=self.name)
            for joint in range(robot.n)
            for symbol, unit in self.units(force_unit(robot, joint), length_unit(robot, joint)).items()
        )

    def regressor(self, robot: Robot, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX) -> casadi.SX:
        """Builds Y (n, k n), block diagonal.

        Raises:
            InputError: velocity scales for another number of joints.
        """
        scales = self.velocity_scale if isinstance(self.velocity_scale, tuple) else (self.velocity_scale,) * robot.n
        if len(scales) != robot.n:
            raise InputError(f"{len(scales)} friction velocity scales", allowed=f"one, or {robot.n}")
        rows = []
        for joint, scale in enumerate(scales):
            sign = casadi.tanh(dq[joint] / scale) if scale else casadi.sign(dq[joint])
            rows.append(self.row(dq[joint], sign, scale))
        return casadi.diagcat(*rows)

    def nominal(self, robot: Robot) -> NDArray[np.float64]:
        """Gives no values (k n,): a description states those of the polynomial."""
        return np.full(len(self.columns(robot)), np.nan)


@dataclass(frozen=True, kw_only=True)
class FrictionPolynomial(FrictionTerm):
    """tau_f = f1 sign(dq) + f2 dq + f3 dq |dq| + f4 dq^3, on each joint.

    Attributes:
        powers: which of f1..f4 are there: (1, 2) is Coulomb and viscous friction.
        velocity_scale: see `FrictionTerm`.
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
        super().__post_init__()

    def units(self, force: str, length: str) -> dict[str, str]:
        """Gives the units of f1.. of one joint."""
        every = {1: force, 2: f"{force} s/{length}", 3: f"{force} s2/{length}2", 4: f"{force} s3/{length}3"}
        return {f"f{power}": every[power] for power in self.powers}

    def row(self, dq: casadi.SX, sign: casadi.SX, scale: float) -> casadi.SX:
        """Builds the chosen powers (1, k)."""
        shapes = {1: sign, 2: dq, 3: dq * casadi.fabs(dq), 4: dq**3}
        return casadi.horzcat(*(shapes[power] for power in self.powers))

    def nominal(self, robot: Robot) -> NDArray[np.float64]:
        """Gives the described coefficients (k n,)."""
        indices = [power - 1 for power in self.powers]
        return np.asarray(robot.friction, dtype=float)[:, indices].reshape(-1)
