"""A finite Fourier series plus a fifth-order polynomial: rest to rest whatever the coefficients."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from oed.trajectories.base import Array, Kinematics, Trajectory, frozen
from oed.trajectories.fourier import fourier_basis
from robots.common.errors import InputError


@dataclass(frozen=True, kw_only=True, eq=False)
class FourierPolynomial(Trajectory):
    """Joint positions as a Fourier series, brought to rest at both ends by a polynomial of degree five.

    With f_i the series of thesis eq. 78 without its offset and p_i the quintic that is fixed by the six conditions::

        q_i(t) = f_i(t) + p_i(t),    q_i(0) = start_i,  q_i(T) = end_i,  dq_i = ddq_i = 0 at 0 and T

    The coefficients a, b are free, and the duration T need be no multiple of the base period.

    Args:
        start: first pose, (n,) [rad].
        end: last pose, (n,) [rad].
        a: cosine coefficients of the velocity, (n, N) [rad/s].
        b: sine coefficients of the velocity, (n, N) [rad/s].
        base_frequency: frequency of the first harmonic [Hz].
        duration: T [s].

    Raises:
        InputError: shapes that do not fit, no harmonic, or a frequency or duration that is not positive.
    """

    start: Array
    end: Array
    a: Array
    b: Array
    base_frequency: float
    # Without a default the base class' property of this name would become one; zero is refused.
    duration: float = 0.0

    def __post_init__(self) -> None:
        for name, ndim in (("start", 1), ("end", 1), ("a", 2), ("b", 2)):
            object.__setattr__(self, name, frozen(getattr(self, name), name, ndim))
        shapes = [getattr(self, name).shape for name in ("start", "end", "a", "b")]
        if shapes[0] != shapes[1] or shapes[2] != shapes[3] or self.a.shape[0] != self.start.size or not self.a.size:
            raise InputError(
                f"found the shapes {', '.join(map(str, shapes))} of start, end, a and b",
                allowed="(n,), (n,), (n, N) and (n, N) with N >= 1",
            )
        _check_times(self.base_frequency, self.duration)

    @classmethod
    def from_coefficients(cls, coefficients: ArrayLike, base_frequency: float, duration: float) -> FourierPolynomial:
        """Builds the motion from one row [start, end, a1..aN, b1..bN] per joint.

        Args:
            coefficients: (n, 2N+2), the inverse of the property `coefficients`.
            base_frequency: frequency of the first harmonic [Hz].
            duration: T [s].

        Returns:
            The motion.

        Raises:
            InputError: the rows have an odd length.
        """
        rows = frozen(coefficients, "coefficients", 2)
        if rows.shape[1] % 2:
            raise InputError(f"found rows of {rows.shape[1]} coefficients", allowed="2N+2: start, end, a1..aN, b1..bN")
        split = 2 + (rows.shape[1] - 2) // 2
        return cls(
            start=rows[:, 0],
            end=rows[:, 1],
            a=rows[:, 2:split],
            b=rows[:, split:],
            base_frequency=base_frequency,
            duration=duration,
        )

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.start.size

    @property
    def harmonics(self) -> int:
        """Number of harmonics N."""
        return self.a.shape[1]

    @property
    def coefficients(self) -> Array:
        """One row [start, end, a1..aN, b1..bN] per joint, (n, 2N+2) [rad, rad/s]."""
        return np.column_stack([self.start, self.end, self.a, self.b])

    def basis(self, t: ArrayLike) -> Kinematics:
        """The matrices that map `coefficients` to the kinematics, common to all joints (`fourier_polynomial_basis`).

        Args:
            t: times, (M,) [s].

        Returns:
            Four matrices (M, 2N+2): q = Bq @ coefficients.T, and so on.
        """
        return fourier_polynomial_basis(t, self.harmonics, self.base_frequency, self.duration)

    def sample(self, t: ArrayLike) -> Kinematics:
        """Evaluates the motion; a time outside the duration takes the value at the nearer end.

        Args:
            t: times, (N,) [s].

        Returns:
            Position, velocity, acceleration and jerk, each (N, n).
        """
        columns = self.coefficients.T
        return Kinematics(*(matrix @ columns for matrix in self.basis(t)))


def fourier_polynomial_basis(t: ArrayLike, harmonics: int, base_frequency: float, duration: float) -> Kinematics:
    """Evaluates the basis functions of the series with its polynomial, and their derivatives.

    Each wave f of thesis eq. 78 becomes f - h, with h the quintic that has its value, slope and curvature at both ends
    (Hermite). The first two functions are 1 - s and s, s = 10 x^3 - 15 x^4 + 6 x^5, x = t/T. A motion that ends where
    it starts adds those two columns into one.

    Args:
        t: times, (M,) [s]; one outside 0..duration takes the value at the nearer end.
        harmonics: number of harmonics N.
        base_frequency: frequency of the first harmonic [Hz].
        duration: T [s].

    Returns:
        Four matrices (M, 2N+2) for [start, end, a1..aN, b1..bN]: position, velocity, acceleration, jerk. Every function
        rests at 0 and T.

    Raises:
        InputError: no harmonic, or a frequency or duration that is not positive.
    """
    if harmonics < 1:
        raise InputError(f"found {harmonics} harmonics", allowed="at least 1")
    _check_times(base_frequency, duration)
    times = np.clip(np.asarray(t, dtype=np.float64), 0.0, duration)
    waves = fourier_basis(times, harmonics, base_frequency)
    ends = fourier_basis(np.array([0.0, duration]), harmonics, base_frequency)
    hermite = _hermite(times / duration)
    # Conditions: value, slope and curvature at the start, then at the end, in units of x; (6, 2N).
    conditions = np.vstack([duration**order * ends[order][end, None, 1:] for end in (0, 1) for order in range(3)])
    matrices = []
    for order in range(4):
        quintics = hermite[order] / duration**order  # (M, 6)
        matrices.append(np.hstack([quintics[:, [0, 3]], waves[order][:, 1:] - quintics @ conditions]))
    # What vanishes by construction would be left as rounding dust of the waves.
    still = (times == 0.0) | (times == duration)
    for matrix in matrices[1:3]:
        matrix[still] = 0.0
    matrices[0][times == 0.0] = np.eye(2 * harmonics + 2)[0]
    matrices[0][times == duration] = np.eye(2 * harmonics + 2)[1]
    return Kinematics(*matrices)


def _hermite(x: Array) -> list[Array]:
    """The six quintic Hermite functions on 0..1 and three derivatives, (M, 6) each: 1, x, x^2/2 at 0, then at 1."""
    powers = np.array(
        [
            [1.0, 0.0, 0.0, -10.0, 15.0, -6.0],
            [0.0, 1.0, 0.0, -6.0, 8.0, -3.0],
            [0.0, 0.0, 0.5, -1.5, 1.5, -0.5],
            [0.0, 0.0, 0.0, 10.0, -15.0, 6.0],
            [0.0, 0.0, 0.0, -4.0, 7.0, -3.0],
            [0.0, 0.0, 0.0, 0.5, -1.0, 0.5],
        ]
    )
    values = []
    for _ in range(4):
        values.append(np.polynomial.polynomial.polyval(x, powers.T).T)
        powers = powers[:, 1:] * np.arange(1, powers.shape[1])
    return values


def _check_times(base_frequency: float, duration: float) -> None:
    if not (np.isfinite(base_frequency) and base_frequency > 0):
        raise InputError(f"found the base frequency {base_frequency} Hz", allowed="a positive number")
    if not (np.isfinite(duration) and duration > 0):
        raise InputError(f"found a duration of {duration} s", allowed="a positive number")
