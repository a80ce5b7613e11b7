"""Limits of the joints, and a motion's margins to them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.records import read_null_as
from robots.joints.velocity_ramps import VelocityRamp
from robots.signals import Motion

ACCELERATION_PER_VELOCITY = 4.0
"""Default acceleration limit over the velocity limit [1/s]: full speed in a quarter of a second, as small arms do."""

JERK_PER_ACCELERATION = 20.0
"""Default jerk limit over the acceleration limit [1/s]: full acceleration within 50 ms."""


UNITS = {
    "position": ("rad", "m"),
    "lower": ("rad", "m"),
    "upper": ("rad", "m"),
    "velocity": ("rad/s", "m/s"),
    "acceleration": ("rad/s2", "m/s2"),
    "jerk": ("rad/s3", "m/s3"),
    "torque": ("N m", "N"),
    "torque RMS": ("N m", "N"),
}
"""Units of quantities of a revolute and of a prismatic joint."""

BOUNDS = ("lower", "upper", "velocity", "acceleration", "jerk", "torque", "torque_rms")
"""Names of the bounds of `Limits`."""


@dataclass(frozen=True, kw_only=True)
class Margin:
    """The closest approach of one joint to one limit.

    Args:
        quantity: "lower" or "upper" (position), "velocity", "acceleration", "jerk", or another, such as "torque".
        joint: the joint, counted from 1.
        value: the value at the closest approach, with its sign, in the unit of the quantity.
        limit: the bound; of a symmetric one its magnitude.
        time: when it happens [s].
        slack_fraction: the distance to the limit over the limit (of a position: over its range); 1 far from it or where
            there is no limit, 0 on it, negative beyond it.
    """

    ENTRIES = ("quantity", "joint", "unit?", "value", "limit", "time", "slack_fraction")

    quantity: str
    joint: int
    value: float
    limit: float = field(metadata=read_null_as(np.inf))
    time: float
    slack_fraction: float

    def unit(self, limits: Limits | None = None) -> str | None:
        """Unit of the value, by the limits of the joints; None where they are not given."""
        return None if limits is None else limits.unit(self.joint - 1, self.quantity)

    @property
    def text(self) -> str:
        """Quantity, joint and time, such as "velocity of joint 3 at 1.204 s"."""
        quantity = "position" if self.quantity in ("lower", "upper") else self.quantity
        return f"{quantity} of joint {self.joint} at {self.time:.3f} s"

    @property
    def slack(self) -> float:
        """The distance to the limit in the unit of the quantity, negative beyond it."""
        if self.quantity == "lower":
            return self.value - self.limit
        return self.limit - (self.value if self.quantity == "upper" else abs(self.value))

    @property
    def violated(self) -> bool:
        """Whether the limit is exceeded."""
        return self.slack < 0.0


@dataclass(frozen=True, eq=False)
class Limits:
    """The bounds of n joints; infinite where there is none.

    A velocity of zero can be stated: that no motion fits is for the design to say. A torque of zero cannot.

    Args:
        lower: lowest positions [rad], (n,).
        upper: highest positions [rad], (n,).
        velocity: highest speeds [rad/s], (n,).
        acceleration: highest accelerations [rad/s^2], (n,).
        jerk: highest jerks [rad/s^3], (n,).
        torque: highest joint torques [N m], (n,).
        torque_rms: highest root mean square of the joint torques over a motion [N m], (n,); infinite by default.
        ramp: velocity limits that fall towards the ends of the joints; None where they don't.
        kinds: "revolute" or "prismatic" of each joint, for messages; all revolute by default. The bounds of a prismatic
            joint are in m and N.

    Raises:
        InputError: arrays of different lengths, NaN, ``lower`` not below ``upper``, or a negative bound.
    """

    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    jerk: Array
    torque: Array
    torque_rms: Array = field(default_factory=lambda: np.array(np.inf))
    ramp: VelocityRamp | None = None
    kinds: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if np.ndim(self.torque_rms) == 0:
            object.__setattr__(self, "torque_rms", np.full(len(np.atleast_1d(self.lower)), float(self.torque_rms)))
        object.__setattr__(self, "kinds", tuple(self.kinds) or ("revolute",) * len(np.atleast_1d(self.lower)))
        for name in BOUNDS:
            array = _bound(name, getattr(self, name))
            if len(array) != len(np.atleast_1d(self.lower)):
                raise InputError(f"{len(array)} values, but lower has {len(self.lower)}", column=name)
            if name not in ("lower", "upper"):
                _reject(array < 0.0, array, name, "zero or more")
            if name.startswith("torque"):
                _reject(array == 0.0, array, name, "above zero, or inf where unknown (.inf in a YAML)")
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if len(self.kinds) != self.n or not set(self.kinds) <= {"revolute", "prismatic"}:
            raise InputError(f"found the kinds {self.kinds}", allowed=f"{self.n} of revolute and prismatic")
        if self.ramp is not None and len(self.ramp.lower) != self.n:
            raise InputError(f"{len(self.ramp.lower)} values, but lower has {self.n}", column="velocity_ramp")
        wrong = np.flatnonzero(self.lower >= self.upper)
        if len(wrong):
            joint = int(wrong[0])
            raise InputError(
                f"lower {self.lower[joint]:g} is not below upper {self.upper[joint]:g}",
                joint=joint + 1,
                allowed="lower < upper",
            )

    @property
    def n(self) -> int:
        """The number of joints."""
        return len(self.lower)

    def unit(self, joint: int, quantity: str = "position") -> str:
        """Gives the unit of a joint's quantity, such as ``rad/s``, or ``m/s`` of a prismatic joint.

        Args:
            joint: counted from 0.
            quantity: "position", "lower", "upper", "velocity", "acceleration", "jerk", "torque" or "torque RMS"; of
                another one the unit is empty.
        """
        angular, linear = UNITS.get(quantity, ("", ""))
        return linear if self.kinds[joint] == "prismatic" else angular

    @property
    def home(self) -> Array:
        """A pose within the limits (n,): zero, or the middle of a range without zero, or its one end."""
        zero = (self.lower <= 0.0) & (self.upper >= 0.0)
        return np.where(zero, 0.0, self.middle)

    @property
    def middle(self) -> Array:
        """The middle of each range (n,); where an end is open, zero or the other end."""
        ranged = np.isfinite(self.lower) & np.isfinite(self.upper)
        middle = np.where(ranged, (np.where(ranged, self.lower, 0.0) + np.where(ranged, self.upper, 0.0)) / 2.0, 0.0)
        return np.clip(middle, self.lower, self.upper)

    @property
    def position_unit(self) -> str:
        """The unit of positions of any joint: ``rad``, ``m``, or ``rad or m``."""
        return " or ".join(unit for unit in ("rad", "m") if unit in map(self.unit, range(self.n)))

    def scaled(
        self, *, velocity: float = 1.0, acceleration: float = 1.0, jerk: float = 1.0, torque: float = 1.0
    ) -> Limits:
        """Returns limits multiplied by factors, such as 0.8 to keep a reserve; positions stay.

        Args:
            velocity: factor of the velocity limits.
            acceleration: factor of the acceleration limits.
            jerk: factor of the jerk limits.
            torque: factor of the torque limits, peak and root mean square.

        Raises:
            InputError: a factor that is not a positive number.
        """
        factors = {"velocity": velocity, "acceleration": acceleration, "jerk": jerk, "torque": torque}
        for name, factor in factors.items():
            if not (np.isfinite(factor) and factor > 0.0):
                raise InputError(f"a factor of {factor}", column=name, allowed="a positive number")
        scaled = {name: getattr(self, name) * factor for name, factor in factors.items()}
        ramp = None if self.ramp is None else self.ramp.scaled(velocity)
        return replace(self, **scaled, ramp=ramp, torque_rms=self.torque_rms * torque)

    def speed_limit(self, q: NDArray[np.floating], dq: NDArray[np.floating]) -> NDArray[np.float64]:
        """Gives the velocity limits in the directions of motion, as they depend on positions (N, n) [rad/s or m/s].

        Args:
            q: positions (N, n), or (n,) of one state [rad or m].
            dq: velocities (N, n), or (n,), whose signs count [rad/s or m/s].
        """
        return self.velocity if self.ramp is None else self.ramp.allowed(q, dq, self.velocity)

    def margins(self, motion: Motion) -> list[Margin]:
        """Returns the smallest margin of each quantity and joint, quantity by quantity.

        Position has two (lower, upper); jerk is the finite difference of the acceleration, in mid step, and is left out
        of a motion of one sample. Torque is that of a model: see `symmetric_margins`.

        Args:
            motion: the motion, of as many joints.

        Raises:
            InputError: the motion has another number of joints.
        """
        if motion.n != self.n:
            raise InputError(f"the motion has {motion.n} joints, the limits are for {self.n}")
        margins = self._position_margins(motion)
        margins += self._velocity_margins(motion)
        margins += symmetric_margins("acceleration", motion.t, motion.ddq, self.acceleration)
        if len(motion) > 1:
            middle, jerk = finite_jerk(motion)
            margins += symmetric_margins("jerk", middle, jerk, self.jerk)
        return margins

    def _velocity_margins(self, motion: Motion) -> list[Margin]:
        if self.ramp is None:
            return symmetric_margins("velocity", motion.t, motion.dq, self.velocity)
        allowed = self.speed_limit(motion.q, motion.dq)
        slack = allowed - np.abs(motion.dq)
        margins = []
        for joint, row in enumerate(slack.argmin(axis=0)):
            margins.append(
                Margin(
                    quantity="velocity",
                    joint=joint + 1,
                    value=float(motion.dq[row, joint]),
                    limit=float(allowed[row, joint]),
                    time=float(motion.t[row]),
                    slack_fraction=float(slack[row, joint] / self.velocity[joint]),
                )
            )
        return margins

    def _position_margins(self, motion: Motion) -> list[Margin]:
        span = self.upper - self.lower
        margins = []
        for quantity, bound, rows in (
            ("lower", self.lower, motion.q.argmin(axis=0)),
            ("upper", self.upper, motion.q.argmax(axis=0)),
        ):
            for joint, row in enumerate(rows):
                value, limit = float(motion.q[row, joint]), float(bound[joint])
                slack = value - limit if quantity == "lower" else limit - value
                # A range that is open at the other end has no length to compare with.
                scale = span[joint] if np.isfinite(span[joint]) else max(abs(limit), 1.0)
                margins.append(
                    Margin(
                        quantity=quantity,
                        joint=joint + 1,
                        value=value,
                        limit=limit,
                        time=float(motion.t[row]),
                        slack_fraction=float(slack / scale) if np.isfinite(limit) else 1.0,
                    )
                )
        return margins


def symmetric_margins(
    quantity: str, t: Array, values: NDArray[np.floating], limit: NDArray[np.floating]
) -> list[Margin]:
    """Returns the closest approach of each column of any signal to a bound on its magnitude.

    Args:
        quantity: its name, such as "torque".
        t: time [s], (N,).
        values: the signal, (N, n).
        limit: the bound on its magnitude, (n,), zero or more, may be infinite.

    Raises:
        InputError: shapes that do not fit, a value that is not finite, or a negative bound.
    """
    values, bounds = np.asarray(values, dtype=float), _bound(quantity, limit)
    if values.ndim != 2 or values.shape != (len(t), len(bounds)) or len(t) == 0:
        raise InputError(
            f"shape {values.shape}", column=quantity, allowed=f"shape ({len(t)}, {len(bounds)}), not empty"
        )
    _reject(bounds < 0.0, bounds, quantity, "zero or more")
    bad = np.argwhere(~np.isfinite(values))
    if len(bad):
        row, joint = (int(index) for index in bad[0])
        raise InputError(
            f"found {values[row, joint]}", column=quantity, row=row + 1, joint=joint + 1, allowed="finite numbers"
        )
    rows = np.abs(values).argmax(axis=0)
    return [
        Margin(
            quantity=quantity,
            joint=joint + 1,
            value=float(values[row, joint]),
            limit=float(bounds[joint]),
            time=float(t[row]),
            slack_fraction=_slack_fraction(abs(float(values[row, joint])), float(bounds[joint])),
        )
        for joint, row in enumerate(rows)
    ]


def finite_jerk(motion: Motion) -> tuple[Array, Array]:
    """Returns the jerk between samples as the difference of the acceleration over time.

    Args:
        motion: a motion of N samples and n joints.

    Returns:
        The times in mid step [s], (N-1,), and the jerks [rad/s^3], (N-1, n).
    """
    step = np.diff(motion.t)
    return motion.t[:-1] + 0.5 * step, np.diff(motion.ddq, axis=0) / step[:, None]


def _slack_fraction(magnitude: float, limit: float) -> float:
    if limit > 0.0:
        return 1.0 - magnitude / limit
    return 0.0 if magnitude == 0.0 else -np.inf


def _bound(name: str, value: NDArray[np.floating]) -> Array:
    try:
        array = np.array(value, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise InputError(f"not an array of numbers ({error})", column=name, allowed="numbers, (n,)") from error
    if array.ndim != 1 or len(array) == 0:
        raise InputError(f"shape {array.shape}", column=name, allowed="shape (n,)")
    _reject(np.isnan(array), array, name, "a number, or inf for no limit")
    return array


def _reject(wrong: NDArray[np.bool_], array: Array, name: str, allowed: str) -> None:
    if wrong.any():
        joint = int(np.flatnonzero(wrong)[0])
        raise InputError(f"found {array[joint]:g}", column=name, joint=joint + 1, allowed=allowed)
