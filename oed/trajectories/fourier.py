"""The finite Fourier series, the excitation whose derivatives and bounds are known exactly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from oed.trajectories.base import Array, Kinematics, Trajectory, frozen
from robots.common.errors import InputError


@dataclass(frozen=True, kw_only=True, eq=False)
class FourierSeries(Trajectory):
    """Joint positions as finite Fourier series with a common base frequency.

    With w = 2 pi base_frequency (thesis eq. 78 to 80; Swevers et al. 1997)::

        q_i(t)   = q0_i + sum_l a_li / (w l) sin(w l t) - b_li / (w l) cos(w l t)
        dq_i(t)  = sum_l a_li cos(w l t) + b_li sin(w l t)
        ddq_i(t) = w sum_l l (-a_li sin(w l t) + b_li cos(w l t))

    The factor l in the acceleration is missing in the thesis' eq. 80; it follows from eq. 79.

    Args:
        offsets: q0, (n,) [rad].
        a: cosine coefficients of the velocity, (n, N) [rad/s].
        b: sine coefficients of the velocity, (n, N) [rad/s].
        base_frequency: frequency of the first harmonic [Hz].
        periods: how many periods the trajectory lasts.

    Raises:
        InputError: shapes that do not fit, no harmonic, or a frequency or number of periods that is not positive.
    """

    offsets: Array
    a: Array
    b: Array
    base_frequency: float
    periods: int = 1

    def __post_init__(self) -> None:
        for name, ndim in (("offsets", 1), ("a", 2), ("b", 2)):
            object.__setattr__(self, name, frozen(getattr(self, name), name, ndim))
        if self.a.shape != self.b.shape or self.a.shape[0] != self.offsets.size or self.a.shape[1] < 1:
            raise InputError(
                f"found the shapes {self.offsets.shape}, {self.a.shape} and {self.b.shape} of offsets, a and b",
                allowed="(n,), (n, N) and (n, N) with N >= 1",
            )
        if not (np.isfinite(self.base_frequency) and self.base_frequency > 0):
            raise InputError(f"found the base frequency {self.base_frequency} Hz", allowed="a positive number")
        if self.periods < 1 or self.periods != int(self.periods):
            raise InputError(f"found {self.periods} periods", allowed="a whole number, at least 1")

    @classmethod
    def from_coefficients(cls, coefficients: ArrayLike, base_frequency: float, periods: int = 1) -> FourierSeries:
        """Builds the series from one row [q0, a1..aN, b1..bN] per joint.

        Args:
            coefficients: (n, 2N+1), the inverse of the property `coefficients`.
            base_frequency: frequency of the first harmonic [Hz].
            periods: how many periods the trajectory lasts.

        Returns:
            The series.

        Raises:
            InputError: the rows have an even length.
        """
        rows = frozen(coefficients, "coefficients", 2)
        if rows.shape[1] % 2 == 0:
            raise InputError(f"found rows of {rows.shape[1]} coefficients", allowed="2N+1: q0, a1..aN, b1..bN")
        order = rows.shape[1] // 2
        return cls(
            offsets=rows[:, 0],
            a=rows[:, 1 : order + 1],
            b=rows[:, order + 1 :],
            base_frequency=base_frequency,
            periods=periods,
        )

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.offsets.size

    @property
    def harmonics(self) -> int:
        """Number of harmonics N, the degree of the trigonometric polynomial and of each of its derivatives."""
        return self.a.shape[1]

    @property
    def duration(self) -> float:
        """Duration in s, a whole number of periods of the base frequency."""
        return self.periods / self.base_frequency

    @property
    def coefficients(self) -> Array:
        """One row [q0, a1..aN, b1..bN] per joint, (n, 2N+1) [rad, rad/s]."""
        return np.column_stack([self.offsets, self.a, self.b])

    def basis(self, t: ArrayLike) -> Kinematics:
        """The matrices that map `coefficients` to the kinematics, common to all joints (`fourier_basis`).

        Args:
            t: times, (M,) [s].

        Returns:
            Four matrices (M, 2N+1): q = Bq @ coefficients.T, and so on.
        """
        return fourier_basis(t, self.harmonics, self.base_frequency)

    def sample(self, t: ArrayLike) -> Kinematics:
        """Evaluates the series at any times, also outside its duration, for it is periodic.

        Args:
            t: times, (N,) [s].

        Returns:
            Position, velocity, acceleration and jerk, each (N, n).
        """
        columns = self.coefficients.T
        return Kinematics(*(matrix @ columns for matrix in self.basis(t)))


def fourier_basis(t: ArrayLike, harmonics: int, base_frequency: float) -> Kinematics:
    """Evaluates the basis functions of the series and their derivatives (thesis eq. 78 to 80, and the jerk).

    Args:
        t: times, (M,) [s].
        harmonics: number of harmonics N.
        base_frequency: frequency of the first harmonic [Hz].

    Returns:
        Four matrices (M, 2N+1) for the coefficients [q0, a1..aN, b1..bN]: position, velocity, acceleration, jerk.
    """
    order = np.arange(1, harmonics + 1, dtype=np.float64)
    w = 2.0 * np.pi * base_frequency * order  # [rad/s]
    # Whole turns are taken off before the multiplication by 2 pi, so that every period is evaluated alike.
    turns = np.outer(np.asarray(t, dtype=np.float64) * base_frequency, order)
    phase = 2.0 * np.pi * (turns - np.rint(turns))
    sine, cosine = np.sin(phase), np.cos(phase)
    samples = phase.shape[0]
    zero, one = np.zeros((samples, 1)), np.ones((samples, 1))
    return Kinematics(
        q=np.hstack([one, sine / w, -cosine / w]),
        dq=np.hstack([zero, cosine, sine]),
        ddq=np.hstack([zero, -w * sine, w * cosine]),
        dddq=np.hstack([zero, -(w**2) * cosine, -(w**2) * sine]),
    )


def rest_basis(harmonics: int, base_frequency: float) -> Array:
    """Spans the coefficients of the series that start and end at rest: dq(0) = 0 and ddq(0) = 0.

    The conditions read sum_l a_l = 0 and sum_l l b_l = 0 (thesis eq. 79 and 80 at t = 0). Each is removed by a
    Householder reflection, so that the offset stays a free coefficient of its own and a and b do not mix.

    Args:
        harmonics: number of harmonics N.
        base_frequency: frequency of the first harmonic [Hz].

    Returns:
        Z, (2N+1, 2N-1) with orthonormal columns: coefficients = Z @ free, and free[0] is the offset q0.
    """
    _, dq, ddq, _ = fourier_basis(np.zeros(1), harmonics, base_frequency)
    basis = np.zeros((2 * harmonics + 1, 2 * harmonics - 1))
    basis[0, 0] = 1.0
    basis[1 : harmonics + 1, 1:harmonics] = _complement(dq[0, 1 : harmonics + 1])
    basis[harmonics + 1 :, harmonics:] = _complement(ddq[0, harmonics + 1 :])
    return basis


def _complement(vector: Array) -> Array:
    """Orthonormal basis (N, N-1) of what is orthogonal to a vector with a positive first entry."""
    reflector = vector / np.linalg.norm(vector)
    reflector[0] += 1.0
    reflection = np.eye(vector.size) - 2.0 * np.outer(reflector, reflector) / (reflector @ reflector)
    return reflection[:, 1:]
