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
# Where the saturating parts bend, as shares of the usual highest speed; and where they do so that the polynomial's
# terms are held to 2.4 % of what Coulomb and viscous friction leave of them, instead of 28 %.
BENDS = (0.1, 0.4)
FINE_BENDS = (0.1, 0.4, 1.0)
# Speed [rad/s or m/s] below which a joint stands, and share of the rows whose speed is usual: noise makes larger ones.
STANDING_SPEED, USUAL_SPEED_SHARE = 1e-3, 0.999


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

    def joint_row(self, robot: Robot, joint: int, dq: casadi.SX, sign: casadi.SX, scale: float) -> casadi.SX:
        """Builds the columns (1, k) of joint `joint`, counted from 0, by default those of `row`."""
        return self.row(dq, sign, scale)

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Describes the parameters joint by joint."""
        return tuple(
            Column(
                name=f"{symbol}_{joint + 1}", symbol=symbol, joint=joint + 1, unit=unit, term=self.name, friction=True
            )
            for joint in range(robot.n)
            for symbol, unit in self.units(force_unit(robot, joint), length_unit(robot, joint)).items()
        )

    def regressor(self, robot: Robot, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX) -> casadi.SX:
        """Builds Y (n, k n), block diagonal.

        Raises:
            InputError: the number of velocity scales is not the number of joints.
        """
        rows = []
        for joint, scale in enumerate(_each(self.velocity_scale, robot, "friction velocity scales")):
            sign = casadi.tanh(dq[joint] / scale) if scale else casadi.sign(dq[joint])
            rows.append(self.joint_row(robot, joint, dq[joint], sign, scale))
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


@dataclass(frozen=True, kw_only=True)
class BendingFriction(FrictionTerm):
    """tau_f = f1 sign(dq) + f2 dq + f3 tanh(dq / (b1 v)) + f4 tanh(dq / (b2 v)) + ..., on each joint.

    v is the highest speed of the data. Within it the curve bends as measured ones do: it falls after the start
    (Stribeck) or flattens at high speed. Beyond it grows like f2 dq, so that no log can make it explode.

    Attributes:
        speed: v [rad/s or m/s], one value for all joints or one per joint.
        bends: b1, b2, ...
        velocity_scale: see `FrictionTerm`.

    Raises:
        InputError: a speed or a bend that is not positive, or a negative scale.
    """

    speed: float | tuple[float, ...] = 1.0
    bends: tuple[float, ...] = BENDS
    velocity_scale: float | tuple[float, ...] = 0.0
    name: str = "bending_friction"

    def __post_init__(self) -> None:
        """Checks the speeds, the bends and the scale.

        Raises:
            InputError: a speed or a bend that is not positive, or a negative scale.
        """
        super().__post_init__()
        if not np.all(np.asarray(self.speed) > 0):
            raise InputError(f"highest speed {self.speed} of the friction", allowed="positive numbers")
        if not np.all(np.asarray(self.bends) > 0):
            raise InputError(f"bends {self.bends} of the friction", allowed="positive numbers")

    @classmethod
    def within(cls, speeds: NDArray[np.float64], bends: tuple[float, ...] = BENDS) -> BendingFriction:
        """Builds the friction of motions with these highest speeds (n,) [rad/s or m/s], rounded to two digits."""
        # The speed of a joint at rest is not known.
        return cls(
            speed=tuple(float(f"{speed:.2g}") if speed > STANDING_SPEED else 1.0 for speed in speeds), bends=bends
        )

    def units(self, force: str, length: str) -> dict[str, str]:
        """Returns the units of one joint's coefficients."""
        bent = {f"f{3 + k}": force for k in range(len(self.bends))}
        return {"f1": force, "f2": f"{force} s/{length}"} | bent

    def row(self, dq: casadi.SX, sign: casadi.SX, scale: float) -> casadi.SX:
        """Builds the columns that do not depend on v (1, 2)."""
        return casadi.horzcat(sign, dq)

    def joint_row(self, robot: Robot, joint: int, dq: casadi.SX, sign: casadi.SX, scale: float) -> casadi.SX:
        """Builds the columns of a joint (1, k).

        Raises:
            InputError: the number of speeds is not the number of joints.
        """
        speed = _each(self.speed, robot, "highest speeds of the friction")[joint]
        return casadi.horzcat(self.row(dq, sign, scale), *(casadi.tanh(dq / (share * speed)) for share in self.bends))

    def nominal(self, robot: Robot) -> NDArray[np.float64]:
        """Returns the coefficients (k n,) that come nearest to the description's polynomial up to each v."""
        found = []
        for described, speed in zip(
            np.asarray(robot.friction, dtype=float), _each(self.speed, robot, "speeds"), strict=True
        ):
            v = speed * (np.arange(50) + 0.5) / 50
            shapes = np.column_stack([np.ones_like(v), v, *(np.tanh(v / (share * speed)) for share in self.bends)])
            polynomial = np.column_stack([np.ones_like(v), v, v**2, v**3]) @ described
            found.append(np.linalg.lstsq(shapes, polynomial, rcond=None)[0])
        return np.concatenate(found)


def _each(value: float | tuple[float, ...], robot: Robot, what: str) -> tuple[float, ...]:
    """One value per joint.

    Raises:
        InputError: neither one value, nor as many as joints.
    """
    values = value if isinstance(value, tuple) else (value,) * robot.n
    if len(values) != robot.n:
        raise InputError(f"{len(values)} {what}", allowed=f"one, or {robot.n}")
    return values
