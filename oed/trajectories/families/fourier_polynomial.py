"""A finite Fourier series plus a fifth-order polynomial: rest to rest whatever the coefficients."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from oed.trajectories.base import Array, Kinematics
from oed.trajectories.families.harmonic import HarmonicFamily
from oed.trajectories.fourier import fourier_basis


@dataclass(frozen=True, kw_only=True)
class FourierPolynomial(HarmonicFamily):
    """The modified Fourier series: its waves, brought to rest at both ends by a polynomial of degree five.

    With f_i the series of thesis eq. 78 without its offset, and p_i the quintic that six conditions fix::

        q_i(t) = q0_i + f_i(t) + p_i(t),    q_i = q0_i and dq_i = ddq_i = 0 at 0 and T

    All 2 N + 1 coefficients q0, a, b are free.

    Attributes:
        harmonics: N, at least 2.
        base_frequency: 1 / T, of the first harmonic [Hz].

    Raises:
        InputError: numbers out of range.
    """

    name: ClassVar[str] = "fourier-polynomial"

    @property
    def size(self) -> int:
        """2 N + 1."""
        return 2 * self.harmonics + 1

    def basis(self, t: ArrayLike) -> Kinematics:
        """Evaluates f - h for each wave f, with h the quintic of its value, slope and curvature at both ends."""
        times = np.clip(np.asarray(t, dtype=np.float64), 0.0, self.duration)
        waves = fourier_basis(times, self.harmonics, self.base_frequency)
        ends = fourier_basis(np.array([0.0, self.duration]), self.harmonics, self.base_frequency)
        hermite = _hermite(times / self.duration)
        # Value, slope and curvature at the start, then at the end, in units of x = t / T; (6, 2 N).
        conditions = np.vstack(
            [self.duration**order * ends[order][end, None, 1:] for end in (0, 1) for order in range(3)]
        )
        matrices = []
        for order in range(4):
            quintics = hermite[order] / self.duration**order  # (M, 6)
            constant = np.full((len(times), 1), float(order == 0))
            matrices.append(np.hstack([constant, waves[order][:, 1:] - quintics @ conditions]))
        # What vanishes by construction would be left as rounding dust of the waves.
        still = (times == 0.0) | (times == self.duration)
        for matrix in matrices[:3]:
            matrix[still, 1:] = 0.0
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
