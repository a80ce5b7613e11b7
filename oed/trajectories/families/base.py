"""What a family of optimised motions is: a basis, common to all joints, that rests at both ends."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import asdict, dataclass, is_dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from oed.trajectories.base import Array, Kinematics, Trajectory, frozen
from robots.common.errors import InputError

# Points between two samples at which the overshoot is measured; it bends like a parabola there, so that the largest is
# met to a 64th.
POINTS_BETWEEN = 8
PARABOLA = 1 + 1 / POINTS_BETWEEN**2


class Family(ABC):
    """Motions that are linear in a few coefficients a joint: q_i(t) = sum_k basis_k(t) free_ik.

    The first basis function is one at all times: its coefficient is where the joint starts and, in most families, also
    ends. All others begin and end with the same position, and with a velocity and an acceleration of zero, so that the
    motion can be repeated and chained. Members are frozen dataclasses.

    Attributes:
        name: as the command line spells it.
        kind: of the segments that it makes in a design file.
    """

    name: ClassVar[str]
    kind: ClassVar[str] = "excitation"

    @classmethod
    @abstractmethod
    def of_size(cls, harmonics: int, base_frequency: float) -> Self:
        """Builds the member with about as many coefficients as a Fourier series at rest, 2 N - 1 a joint.

        Args:
            harmonics: N.
            base_frequency: one over the duration of a repetition [Hz].
        """

    @property
    @abstractmethod
    def size(self) -> int:
        """K, the number of free coefficients of each joint."""

    @property
    @abstractmethod
    def duration(self) -> float:
        """Of one repetition [s]."""

    @abstractmethod
    def basis(self, t: ArrayLike) -> Kinematics:
        """Evaluates the basis functions and their derivatives.

        Args:
            t: times from 0 to the duration (M,) [s].

        Returns:
            Four matrices (M, K): position, velocity, acceleration, jerk.
        """

    def trajectory(self, free: Array, periods: int = 1) -> Trajectory:
        """Builds the motion of free coefficients.

        Args:
            free: coefficients (n, K).
            periods: how often the motion is repeated.
        """
        return Excitation(family=self, free=free, periods=periods)

    def coefficients(self, free: Array) -> Array:
        """Gives the coefficients as a design file lists them, (n, K) by default.

        Args:
            free: coefficients (n, K).
        """
        return free

    def settings(self) -> dict[str, Any]:
        """Gives the family's name and settings as plain data."""
        own: dict[str, Any] = asdict(self) if is_dataclass(self) and not isinstance(self, type) else {}
        return {"name": self.name, **own}

    @property
    def fastest(self) -> float:
        """The rate w [rad/s] with ``max |p'| <= w max |p - c|`` for the motion and each derivative p (Bernstein).

        Infinite where no such inequality is known.
        """
        return np.inf

    def regressor_times(self, samples: int) -> Array:
        """Times (M,) [s] at which the regressor counts, half a step off the ends: at rest a row has no information.

        Args:
            samples: M.
        """
        return (np.arange(samples) + 0.5) / samples * self.duration

    def limit_times(self, samples: int) -> Array:
        """Times (M,) [s] at which limits are imposed, evenly spaced; both ends by default.

        Args:
            samples: M.
        """
        return np.linspace(0.0, self.duration, samples)

    def shares(self, samples: int) -> tuple[float, ...]:
        """Shares of the limits of q, dq, ddq and dddq that, kept at `limit_times`, keep the limits at all times.

        Between two samples the basis differs from its chord by r(t). The coefficients follow from the M samples,
        ``x = B^+ (B x)``, so ``|r(t) x| <= ||r(t) B^+||_1 max |B x|``. With e the largest such norm, the maximum of
        ``|p - c|`` over time is at most (1 + e) times that over the samples. The norm is evaluated at some times
        between the samples, with a reserve for the times between those.

        Args:
            samples: M.
        """
        times = self.limit_times(samples)
        fine = np.linspace(times[0], times[-1], POINTS_BETWEEN * (samples - 1) + 1)
        rising = np.arange(POINTS_BETWEEN) / POINTS_BETWEEN
        shares = []
        for coarse, dense in zip(self.basis(times), self.basis(fine), strict=True):
            chord = (1 - rising)[:, None] * coarse[:-1, None] + rising[:, None] * coarse[1:, None]
            apart = dense[:-1].reshape(samples - 1, POINTS_BETWEEN, -1) - chord
            inverse = np.linalg.pinv(coarse, rcond=1e-9)
            overshoot = np.abs(apart @ inverse).sum(axis=2).max()
            shares.append(float(1 / (1 + PARABOLA * overshoot)))
        return tuple(shares)

    def scale(self, half: Array, velocity: Array) -> Array:
        """Sizes (n, K) of the coefficients that bring a joint to its limits.

        Args:
            half: of each joint's range (n,) [rad or m].
            velocity: its limit (n,) [rad/s or m/s].
        """
        q, dq, *_ = self.basis(self.limit_times(50 * self.size))
        with np.errstate(divide="ignore"):
            reach = half[:, None] / np.abs(q).max(axis=0)
            speed = velocity[:, None] / 2 / np.abs(dq).max(axis=0)
        return np.minimum(reach, speed)


@dataclass(frozen=True, kw_only=True, eq=False)
class Excitation(Trajectory):
    """Free coefficients of a family, repeated.

    Args:
        family: gives the basis.
        free: coefficients (n, K).
        periods: how often the motion is repeated.

    Raises:
        InputError: coefficients of another shape, or a number of periods that is not positive.
    """

    family: Family
    free: Array
    periods: int = 1

    def __post_init__(self) -> None:
        object.__setattr__(self, "free", frozen(self.free, "free", 2))
        if self.free.shape[1] != self.family.size or not self.free.shape[0]:
            raise InputError(f"coefficients of shape {self.free.shape}", allowed=f"(n, {self.family.size})")
        if self.periods < 1 or self.periods != int(self.periods):
            raise InputError(f"found {self.periods} periods", allowed="a whole number, at least 1")

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.free.shape[0]

    @property
    def duration(self) -> float:
        """Of all repetitions [s]."""
        return self.periods * self.family.duration

    def sample(self, t: ArrayLike) -> Kinematics:
        """Evaluates the motion; a time outside its duration takes the value at the nearer end.

        Args:
            t: times (N,) [s].

        Returns:
            Position, velocity, acceleration and jerk, each (N, n).
        """
        once = self.family.duration
        times = np.clip(np.asarray(t, dtype=np.float64), 0.0, self.duration)
        turns = np.minimum(np.floor(times / once + 1e-12), self.periods - 1)
        within = np.clip(times - turns * once, 0.0, once)
        return Kinematics(*(matrix @ self.free.T for matrix in self.family.basis(within)))


def check_family(family: Family) -> None:
    """Checks a family's basis once, before a design: its shapes, its ends, and its derivatives.

    Raises:
        InputError: naming the family and what its basis gives.
    """
    called = f"the trajectory family {getattr(family, 'name', type(family).__name__)!r}"
    if not isinstance(family, Family):
        raise InputError(f"{called} is no Family", allowed="an instance of a subclass of oed.Family")
    if not (np.isfinite(family.duration) and family.duration > 0):
        raise InputError(f"{called} lasts {family.duration} s", allowed="a positive time")
    times, step = np.linspace(0.0, family.duration, 101), 1e-6 * family.duration
    basis = tuple(np.asarray(matrix, dtype=np.float64) for matrix in family.basis(times))
    shapes = [matrix.shape for matrix in basis]
    if shapes != [(101, family.size)] * 4:
        raise InputError(f"{called} gives a basis of shapes {shapes}", allowed=f"four of (101, {family.size})")
    if not all(np.isfinite(matrix).all() for matrix in basis):
        raise InputError(f"{called} gives a basis that is not finite")
    if not (np.allclose(basis[0][:, 0], 1.0) and not any(matrix[:, 0].any() for matrix in basis[1:])):
        raise InputError(f"the first function of {called} is not constant", allowed="one, with derivatives of zero")
    sizes = [np.abs(matrix).max() or 1.0 for matrix in basis]
    # The ends of a basis are at rest, up to this share of the largest value.
    at_rest = 1e-9
    if np.abs(basis[0][-1] - basis[0][0]).max() > at_rest * sizes[0]:
        raise InputError(f"{called} does not end where it starts")
    for name, matrix, size in zip(("velocity", "acceleration"), basis[1:3], sizes[1:3], strict=True):
        if np.abs(matrix[[0, -1]]).max() > at_rest * size:
            raise InputError(f"{called} is not at rest at both ends: its {name} is not zero there")
    inner = times[1:-1]
    ahead, behind = family.basis(inner + step), family.basis(inner - step)
    for order, name in enumerate(("velocity", "acceleration", "jerk"), start=1):
        quotient = (ahead[order - 1] - behind[order - 1]) / (2 * step)
        # A jerk may jump at a knot, and the quotient there is a mean of both sides.
        # Rates agree with the difference quotient to this share of the largest.
        wrong = np.median(np.abs(quotient - basis[order][1:-1])) > 1e-4 * sizes[order]
        if wrong:
            raise InputError(f"the {name} of {called} is not the derivative of what comes before it")


def described(family: Family, free: Array) -> Mapping[str, Any]:
    """Writes a family and its coefficients as plain data, for a design file."""
    return {**family.settings(), "coefficients": family.coefficients(free).tolist()}
