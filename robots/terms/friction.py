"""Joint friction: the interface of friction terms, and the polynomial in the velocity (thesis eq. 35)."""

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
    """Friction of each joint as a function of its own velocity: tau_j = row(dq_j) pi_j, the same on all joints.

    A subclass is a frozen dataclass with `name`, `units`, `row` and, if a description states values, `nominal`.

    Attributes:
        velocity_scale: v0 [rad/s or m/s], one value for all joints or one per joint. With v0 > 0, sign(dq) is
            tanh(dq / v0). That is differentiable, as a design requires, and has a finite slope if a log's velocity is
            known to v0 only. With 0 it is the sharp sign.

    Raises:
        InputError: the scale is negative.
    """

    velocity_scale: float | tuple[float, ...] = 0.0

    def __post_init__(self) -> None:
        if not np.all(np.asarray(self.velocity_scale) >= 0):
            raise InputError(f"friction velocity scale {self.velocity_scale}", allowed="zero or a positive number")

    @abstractmethod
    def units(self, force: str, length: str) -> dict[str, str]:
        """Returns the unit of each parameter of one joint, by its symbol, in the order of the columns.

        Args:
            force: unit of the joint's torque, ``N m`` or ``N``.
            length: unit of its position, ``rad`` or ``m``.
        """

    @abstractmethod
    def row(self, dq: casadi.SX, sign: casadi.SX, scale: float) -> casadi.SX:
        """Builds the columns (1, k) of one joint.

        Args:
            dq: its velocity [rad/s or m/s].
            sign: sign(dq), smoothed by the joint's velocity scale.
            scale: the joint's velocity scale [rad/s or m/s]; 0 for the sharp sign.
        """

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Describes the parameters joint by joint."""
        return tuple(
            Column(name=f"{symbol}_{joint + 1}", symbol=symbol, joint=joint + 1, unit=unit, term=self.name)
            for joint in range(robot.n)
            for symbol, unit in self.units(force_unit(robot, joint), length_unit(robot, joint)).items()
        )

    def regressor(self, robot: Robot, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX) -> casadi.SX:
        """Builds Y (n, k n), block diagonal.

        Raises:
            InputError: the number of velocity scales is not the number of joints.
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
        """Returns NaN for all parameters (k n,), because a description states only those of the polynomial."""
        return np.full(len(self.columns(robot)), np.nan)


@dataclass(frozen=True, kw_only=True)
class FrictionPolynomial(FrictionTerm):
    """tau_f = f1 sign(dq) + f2 dq + f3 dq |dq| + f4 dq^3, on each joint.

    Attributes:
        powers: which of f1..f4 the model has; (1, 2) is Coulomb and viscous friction.
        velocity_scale: see `FrictionTerm`.
    """

    powers: tuple[int, ...] = POLYNOMIAL
    velocity_scale: float | tuple[float, ...] = 0.0
    name: str = "friction"

    def __post_init__(self) -> None:
        """Checks the powers and the scale.

        Raises:
            InputError: a power is unknown or repeated, or the scale is negative.
        """
        known = all(power in POLYNOMIAL for power in self.powers)
        if not self.powers or not known or len(set(self.powers)) < len(self.powers):
            raise InputError(f"friction powers {self.powers}", allowed="some of 1, 2, 3, 4, each once")
        super().__post_init__()

    def units(self, force: str, length: str) -> dict[str, str]:
        """Returns the units of one joint's coefficients f1 to f4, for the powers that the model has."""
        every = {1: force, 2: f"{force} s/{length}", 3: f"{force} s2/{length}2", 4: f"{force} s3/{length}3"}
        return {f"f{power}": every[power] for power in self.powers}

    def row(self, dq: casadi.SX, sign: casadi.SX, scale: float) -> casadi.SX:
        """Builds the columns of the chosen powers (1, k)."""
        shapes = {1: sign, 2: dq, 3: dq * casadi.fabs(dq), 4: dq**3}
        return casadi.horzcat(*(shapes[power] for power in self.powers))

    def nominal(self, robot: Robot) -> NDArray[np.float64]:
        """Returns the coefficients of the robot's description (k n,)."""
        indices = [power - 1 for power in self.powers]
        return np.asarray(robot.friction, dtype=float)[:, indices].reshape(-1)
