"""Description of a robot before any experiment: geometry, limits and nominal dynamics."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.plain import as_html
from robots.geometry.chain import Chain, LinkPlace
from robots.joints.controller_axes import ControllerAxes
from robots.limits import Limits

MASSES_REMEDY = "state them under dynamics.links of a robot YAML, or assume usual ones (--assume-masses KG of payload)"
"""What to do where masses are unknown."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Robot:
    """A robot: its chain, its limits, and what is known of its dynamics.

    Args:
        name: short name, as in the catalogue.
        chain: the kinematic chain.
        limits: limits of the n joints.
        inertia: (n, 10) per link ``m, mPx, mPy, mPz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz`` [kg, kg m, kg m2] about the
            link frame's origin, in its axes; a row of NaN where unknown. All unknown by default.
        rotor_inertia: (n,) as felt at the joint, ``gear_ratio^2 J_motor`` [kg m2, or kg of a prismatic joint];
            0 where unknown.
        friction: (n, 4) coefficients f1..f4 of ``f1 sign(dq) + f2 dq + f3 dq |dq| + f4 dq^3``
            [N m, N m s/rad, N m s2/rad2, N m s3/rad3]; 0 where unknown.
        gear_ratio: (n,) motor turns per joint turn; 1 where unknown.
        torque_constant: (n,) joint torque per motor current, ``gear_ratio k_motor`` [N m/A]; NaN where unknown.
        motor_speed: (n,) highest speed of each motor [rad/s]; infinite where unknown. The joint's velocity limit is
            lowered to what the gear makes of it.
        period: sample period of the controller [s].
        assumed: the quantities that no source backs, such as "limits.jerk".
        notes: what a reader of its file may not expect: values by default, doubtful ones, parts that are not used.
        origin: the catalogue name, or the file it was read from.
        stated: the words after ``--robot`` that give it, with the options that choose its joints; empty without.
        digest: SHA-256 of what defines the robot; empty for a robot made in memory.
        urdf: the URDF or xacro file it was read from, with the file's path and arguments; empty without one.
        mjcf: the MJCF file it was read from; empty without one.
        links: the links of that file and the bodies that carry them.
        title: full name, for reports.
        payload: rated payload [kg].
        ambient: (lowest, highest) ambient temperature of operation [degC].
        axes: how the controller counts the joints; None where that is not stated.

    Raises:
        InputError: naming the joint and the quantity that is of a wrong shape or not possible.
    """

    name: str
    chain: Chain
    limits: Limits
    # None stands for unknown until __post_init__ fills in the arrays.
    inertia: Array = None  # type: ignore[assignment]
    rotor_inertia: Array = None  # type: ignore[assignment]
    friction: Array = None  # type: ignore[assignment]
    gear_ratio: Array = None  # type: ignore[assignment]
    torque_constant: Array = None  # type: ignore[assignment]
    motor_speed: Array = None  # type: ignore[assignment]
    period: float = 0.004
    assumed: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    origin: str = ""
    stated: str = ""
    urdf: str = ""
    mjcf: str = ""
    links: tuple[LinkPlace, ...] = ()
    digest: str = ""
    title: str = ""
    payload: float | None = None
    ambient: tuple[float, float] | None = None
    axes: ControllerAxes | None = None

    def __post_init__(self) -> None:
        n = self.n
        if not self.name:
            raise InputError("the robot has no name")
        if len(np.atleast_1d(self.limits.lower)) != n:
            raise InputError(f"{self.name}: limits of {len(self.limits.lower)} joints", allowed=f"{n}, as in the chain")
        if not (np.isfinite(self.period) and self.period > 0.0):
            raise InputError(f"{self.name}: a sample period of {self.period} s", allowed="a positive time")
        self._freeze("inertia", (n, 10), np.nan)
        self._freeze("rotor_inertia", (n,), 0.0)
        self._freeze("friction", (n, 4), 0.0)
        self._freeze("gear_ratio", (n,), 1.0)
        self._freeze("torque_constant", (n,), np.nan)
        unknown = np.isnan(self.inertia).all(axis=1)
        self._require(np.isfinite(self.inertia).all(axis=1) | unknown, "inertia", "ten finite numbers, or ten NaN")
        self._require(self.rotor_inertia >= 0.0, "rotor_inertia", "zero or more")
        self._require(np.isfinite(self.rotor_inertia), "rotor_inertia", "a finite number")
        self._require(np.isfinite(self.friction).all(axis=1), "friction", "finite numbers")
        self._require(np.isfinite(self.gear_ratio) & (self.gear_ratio != 0.0), "gear_ratio", "finite and not zero")
        usable = np.isnan(self.torque_constant) | (np.isfinite(self.torque_constant) & (self.torque_constant != 0.0))
        self._require(usable, "torque_constant", "finite and not zero, or NaN where unknown")
        self._freeze("motor_speed", (n,), np.inf)
        self._require(self.motor_speed > 0.0, "motor_speed", "above zero")
        reachable = self.motor_speed / np.abs(self.gear_ratio)
        if (reachable < self.limits.velocity).any():
            lowered = np.minimum(self.limits.velocity, reachable)
            object.__setattr__(self, "limits", replace(self.limits, velocity=lowered))
        if self.limits.kinds != self.chain.kinds:
            object.__setattr__(self, "limits", replace(self.limits, kinds=self.chain.kinds))
        if self.axes is not None and len(self.axes.sign) != n:
            raise InputError(f"{self.name}: {len(self.axes.sign)} controller axes", allowed=f"{n}, as in the chain")
        object.__setattr__(self, "assumed", tuple(self.assumed))
        object.__setattr__(self, "notes", tuple(self.notes))

    def _freeze(self, quantity: str, shape: tuple[int, ...], unknown: float) -> None:
        value = getattr(self, quantity)
        try:
            array = np.full(shape, unknown) if value is None else np.array(value, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise InputError(f"{self.name}: {quantity} is not numeric") from error
        if array.shape != shape:
            raise InputError(f"{self.name}: {quantity} has the shape {array.shape}", allowed=f"the shape {shape}")
        array.flags.writeable = False
        object.__setattr__(self, quantity, array)

    def _require(self, valid: NDArray[np.bool_] | np.bool_, quantity: str, allowed: str) -> None:
        if not np.all(valid):
            i = int(np.argmin(valid))
            raise InputError(f"{self.name}: {quantity} is {getattr(self, quantity)[i]}", joint=i + 1, allowed=allowed)

    def __repr__(self) -> str:
        known = "known" if self.has_inertia else "unknown"
        return f"Robot({self.name!r}, {self.n} joints, period {1e3 * self.period:g} ms, nominal dynamics {known})"

    def _repr_html_(self) -> str:
        rows: list[tuple[str, ...]] = [("joint", "kind", "lower", "upper", "velocity", "torque")]
        for i, joint in enumerate(self.chain.joints):
            limits = (self.limits.lower[i], self.limits.upper[i], self.limits.velocity[i], self.limits.torque[i])
            rows.append((f"{i + 1} {joint.name}", joint.kind, *(f"{value:.4g}" for value in limits)))
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        table = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in rows]
        return as_html("\n".join([repr(self), "", *table, *(f"note: {note}" for note in self.notes)]))

    @property
    def n(self) -> int:
        """Number of moving joints."""
        return self.chain.n

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joint names from the base to the flange."""
        return self.chain.names

    @property
    def endless(self) -> NDArray[np.bool_]:
        """Which joints turn without end (n,): those that turn and have no position limit."""
        free = ~(np.isfinite(self.limits.lower) | np.isfinite(self.limits.upper))
        return np.asarray(free & (np.array(self.chain.kinds) == "revolute"))

    def under(self, gravity: ArrayLike | None) -> Robot:
        """Gives the robot on a base that stands otherwise, the same object for the same gravity.

        Args:
            gravity: (3,) in the base frame [m/s2]; None for this robot.
        """
        if gravity is None or np.array_equal(gravity, self.chain.gravity):
            return self
        return _standing(self, tuple(float(component) for component in np.asarray(gravity, dtype=float)))

    @property
    def has_inertia(self) -> bool:
        """Whether the inertial parameters of every link are known."""
        return bool(np.isfinite(self.inertia).all())

    @property
    def has_masses(self) -> bool:
        """Whether these are known and not all zero."""
        return self.has_inertia and bool(np.any(self.inertia))


# The robot keeps its compiled functions, so that they are not compiled again for each log.
@lru_cache(maxsize=64)
def _standing(robot: Robot, gravity: tuple[float, ...]) -> Robot:
    return replace(robot, chain=Chain(robot.chain.joints, gravity=np.array(gravity), tip=robot.chain.tip))
