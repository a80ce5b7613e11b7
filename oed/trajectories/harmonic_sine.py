"""The finite sum of harmonic sines, the plainest excitation: bounded by hand, but it starts with speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from oed.trajectories.base import Array, Kinematics, Trajectory, frozen, round_up
from oed.trajectories.ramps import HAIR
from robots.common.errors import InfeasibleError, InputError
from robots.limits import Limits


@dataclass(frozen=True, kw_only=True, eq=False)
class HarmonicSine(Trajectory):
    """Joint positions as sums of sines with a common base frequency.

    With w = 2 pi base_frequency and the multiples k (thesis eq. 62, 66, 68, and 72 to 74 with k = 1, 2, 4)::

        q_i(t)   = q0_i + sum_k a_ki sin(k w t)
        dq_i(t)  = sum_k a_ki k w cos(k w t)
        ddq_i(t) = -sum_k a_ki (k w)^2 sin(k w t)

    Position and acceleration start at q0 and zero, the velocity at sum_k a_k k w (`start_velocity`): played from rest
    it jerks the arm, which spoilt the estimates of the thesis (section 2.3.1). It needs a lead-in that meets that
    speed, or amplitudes with sum_k k a_k = 0. The offset q0 is not in eq. 62; a range that is not about zero needs it.

    Args:
        amplitudes: a, (n, N) [rad].
        base_frequency: w / (2 pi) [Hz].
        offsets: q0, (n,) [rad]; zero by default.
        multiples: the N multiples k of the base frequency; 1 to N by default.
        periods: how many periods of the base frequency the trajectory lasts.

    Raises:
        InputError: shapes that do not fit, no harmonic, multiples that are not increasing whole numbers from 1 up, or
            a frequency or number of periods that is not positive.
    """

    amplitudes: Array
    base_frequency: float
    # None stands for the default until __post_init__ fills it in.
    offsets: Array = None  # type: ignore[assignment]
    multiples: tuple[int, ...] = ()
    periods: int = 1

    def __post_init__(self) -> None:
        amplitudes = frozen(self.amplitudes, "amplitudes", 2)
        offsets = np.zeros(amplitudes.shape[0]) if self.offsets is None else self.offsets
        object.__setattr__(self, "amplitudes", amplitudes)
        object.__setattr__(self, "offsets", frozen(offsets, "offsets", 1))
        object.__setattr__(self, "multiples", _checked_multiples(self.multiples, amplitudes.shape[1]))
        if self.offsets.size != amplitudes.shape[0] or amplitudes.shape[0] < 1:
            raise InputError(
                f"found the shapes {amplitudes.shape} and {self.offsets.shape} of amplitudes and offsets",
                allowed="(n, N) and (n,)",
            )
        if not (np.isfinite(self.base_frequency) and self.base_frequency > 0):
            raise InputError(f"found the base frequency {self.base_frequency} Hz", allowed="a positive number")
        if self.periods < 1 or self.periods != int(self.periods):
            raise InputError(f"found {self.periods} periods", allowed="a whole number, at least 1")

    @classmethod
    def within(
        cls,
        limits: Limits,
        shares: ArrayLike,
        *,
        period: float,
        offsets: ArrayLike | None = None,
        multiples: tuple[int, ...] = (),
        periods: int = 1,
    ) -> HarmonicSine:
        """Builds the fastest such motion whose amplitude bounds keep the limits at all times.

        Amplitudes are shares of what eq. 70 allows, a = share * reach / N, with the reach from the offset to the nearer
        position limit. The base frequency is the highest for which the triangle inequality (eq. 64, 67, 69, and the
        same of the jerk) keeps every rate; with one harmonic, or with shares of one sign as far as velocity and jerk
        go, that limit is met, else it may not be.

        Args:
            limits: bounds of all joints.
            shares: (n, N), -1 to 1.
            period: the controller's period [s]; the base period is rounded up to a multiple of it.
            offsets: (n,) [rad], by default the middle of each range.
            multiples: of the base frequency; 1 to N by default.
            periods: how many periods of the base frequency the trajectory lasts.

        Returns:
            The motion.

        Raises:
            InputError: shares outside -1 to 1 or all zero, a joint that moves without position limits or stands
                outside of them, or no limit of any rate.
            InfeasibleError: a limit of zero of a joint that is to move.
        """
        share = frozen(shares, "shares", 2)
        if np.any(np.abs(share) > 1.0) or not np.any(share):
            raise InputError(
                "the amplitudes lie outside -1 to 1, or are all zero", allowed="-1 to 1, and one that moves"
            )
        factors = _checked_multiples(multiples, share.shape[1])
        bounds = harmonic_sine_bounds(limits, factors, offsets)
        amplitudes = np.where(share == 0.0, 0.0, share * np.where(share == 0.0, 0.0, bounds.amplitude[:, None]))
        if not np.all(np.isfinite(amplitudes)):
            joint = int(np.argmax(~np.isfinite(amplitudes).all(axis=1))) + 1
            raise InputError("moves without position limits", joint=joint, remedy="state them in the robot file")
        moving = np.any(amplitudes != 0.0, axis=1)
        frequency = np.inf
        for order, name in enumerate(("velocity", "acceleration", "jerk"), start=1):
            limit = (1.0 - HAIR) * getattr(limits, name)
            if np.any(moving & (limit <= 0.0)):
                joint = int(np.argmax(moving & (limit <= 0.0))) + 1
                raise InfeasibleError(f"its {name} limit is 0: it cannot move", joint=joint)
            sums = np.abs(amplitudes[moving]) @ np.array(factors, dtype=np.float64) ** order
            frequency = min(frequency, float(((limit[moving] / sums) ** (1.0 / order)).min()))
        if not np.isfinite(frequency):
            raise InputError("no joint that moves has a velocity, acceleration or jerk limit")
        base_period = max(round_up(2.0 * np.pi / frequency, period), period)
        return cls(
            amplitudes=amplitudes,
            base_frequency=1.0 / base_period,
            offsets=bounds.offsets,
            multiples=factors,
            periods=periods,
        )

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.offsets.size

    @property
    def duration(self) -> float:
        """Duration in s, a whole number of periods of the base frequency."""
        return self.periods / self.base_frequency

    @property
    def start_velocity(self) -> Array:
        """Velocity at the start and at the end, sum_k a_k k w, (n,) [rad/s]."""
        return self.amplitudes @ self._rates

    def bounds(self) -> Kinematics:
        """Bounds for all times by the triangle inequality (thesis eq. 64, 66, 69, and the same of the jerk).

        Returns:
            The largest |q - q0|, |dq|, |ddq| and |dddq| that the amplitudes allow, (n,) each.
        """
        return Kinematics(*(np.abs(self.amplitudes) @ self._rates**order for order in range(4)))

    def sample(self, t: ArrayLike) -> Kinematics:
        """Evaluates the sum at any times, also outside its duration, for it is periodic.

        Args:
            t: times, (N,) [s].

        Returns:
            Position, velocity, acceleration and jerk, each (N, n).
        """
        turns = np.outer(np.asarray(t, dtype=np.float64) * self.base_frequency, self.multiples)
        phase = 2.0 * np.pi * (turns - np.rint(turns))
        sine, cosine, w = np.sin(phase), np.cos(phase), self._rates
        waves = (sine, w * cosine, -(w**2) * sine, -(w**3) * cosine)
        q, dq, ddq, dddq = (wave @ self.amplitudes.T for wave in waves)
        return Kinematics(self.offsets + q, dq, ddq, dddq)

    @property
    def _rates(self) -> Array:
        return 2.0 * np.pi * self.base_frequency * np.array(self.multiples, dtype=np.float64)  # [rad/s]


@dataclass(frozen=True, kw_only=True, eq=False)
class HarmonicSineBounds:
    """What the thesis' reasoning allows the amplitudes and frequencies of a harmonic sine.

    Args:
        offsets: q0 about which the joints move, (n,) [rad].
        amplitude: largest amplitude of each of N harmonics, (n,) [rad] (eq. 65, 70).
        frequency: highest k w at that amplitude, (n,) [rad/s] (eq. 67, 69, 71).
    """

    offsets: Array
    amplitude: Array
    frequency: Array


def harmonic_sine_bounds(
    limits: Limits, multiples: tuple[int, ...], offsets: ArrayLike | None = None
) -> HarmonicSineBounds:
    """Bounds amplitudes and frequencies so that any harmonic sine within them keeps the limits (thesis eq. 64 to 71).

    With q_max the distance from the offset to the nearer position limit: a_k <= q_max / N, and
    k w <= min(dq_max / q_max, sqrt(ddq_max / q_max), cbrt(dddq_max / q_max)). Eq. 71 lacks the root that eq. 69 has,
    and the thesis leaves the jerk free.

    Args:
        limits: bounds of all joints.
        multiples: the N multiples k of the base frequency.
        offsets: (n,) [rad], by default the middle of each range, or zero where there is none.

    Returns:
        The bounds.

    Raises:
        InputError: multiples that are not increasing whole numbers, or an offset that is not between the limits.
    """
    factors = _checked_multiples(multiples, len(multiples))
    ranged = np.isfinite(limits.lower) & np.isfinite(limits.upper)
    middle = np.where(ranged, (np.where(ranged, limits.lower, 0.0) + np.where(ranged, limits.upper, 0.0)) / 2.0, 0.0)
    centre = frozen(middle if offsets is None else offsets, "offsets", 1)
    if centre.shape != limits.lower.shape:
        raise InputError(f"found {centre.size} offsets", allowed=f"{limits.n}")
    reach = np.minimum(limits.upper - centre, centre - limits.lower)
    if np.any(reach <= 0.0):
        joint = int(np.argmax(reach <= 0.0))
        raise InputError(
            f"with the offset {centre[joint]:.4g} the joint has no range to move",
            joint=joint + 1,
            allowed=f"between {limits.lower[joint]:.6g} and {limits.upper[joint]:.6g}",
        )
    # Without a range there is no largest amplitude, and no frequency for it.
    finite = np.where(np.isfinite(reach), reach, 1.0)
    rates = (limits.velocity / finite, np.sqrt(limits.acceleration / finite), np.cbrt(limits.jerk / finite))
    frequency = np.where(np.isfinite(reach), np.min(rates, axis=0), 0.0)
    return HarmonicSineBounds(offsets=centre, amplitude=(1.0 - HAIR) * reach / len(factors), frequency=frequency)


def _checked_multiples(multiples: tuple[int, ...], count: int) -> tuple[int, ...]:
    factors = tuple(multiples) or tuple(range(1, count + 1))
    whole = all(factor == int(factor) for factor in factors)
    if len(factors) != count or not factors or not whole or np.any(np.diff([0, *factors]) <= 0):
        raise InputError(
            f"found the multiples {factors} for {count} harmonics", allowed="as many increasing whole numbers from 1 up"
        )
    return tuple(int(factor) for factor in factors)
