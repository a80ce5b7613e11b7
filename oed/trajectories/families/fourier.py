"""The finite Fourier series: smooth, periodic, and bounded exactly between its samples."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from oed.trajectories.base import Array, Kinematics
from oed.trajectories.families.harmonic import HarmonicFamily
from oed.trajectories.fourier import FourierSeries, fourier_basis, rest_basis


@dataclass(frozen=True, kw_only=True)
class Fourier(HarmonicFamily):
    """Fourier series that start and end at rest (thesis eq. 78 to 80), K = 2 N - 1 (`rest_basis`).

    Attributes:
        harmonics: N, at least 2.
        base_frequency: of the first harmonic [Hz].

    Raises:
        InputError: numbers out of range.
    """

    name: ClassVar[str] = "fourier"
    kind: ClassVar[str] = "fourier"

    @property
    def size(self) -> int:
        """2 N - 1."""
        return 2 * self.harmonics - 1

    @cached_property
    def _rest(self) -> Array:
        return rest_basis(self.harmonics, self.base_frequency)

    def basis(self, t: ArrayLike) -> Kinematics:
        """Evaluates the waves that rest at both ends."""
        whole = fourier_basis(t, self.harmonics, self.base_frequency)
        return Kinematics(*(matrix @ self._rest for matrix in whole))

    def coefficients(self, free: Array) -> Array:
        """Gives rows q0, a1..aN, b1..bN (n, 2 N + 1) [rad, rad/s]."""
        return free @ self._rest.T

    def trajectory(self, free: Array, periods: int = 1) -> FourierSeries:
        """Builds the series."""
        return FourierSeries.from_coefficients(self.coefficients(free), self.base_frequency, periods)

    @property
    def fastest(self) -> float:
        """N w, by Bernstein's inequality [rad/s]."""
        return 2 * np.pi * self.base_frequency * self.harmonics

    def regressor_times(self, samples: int) -> Array:
        """Times (M,) [s], half a step off the start."""
        times: Array = (np.arange(samples, dtype=np.float64) + 0.5) / (samples * self.base_frequency)
        return times

    def limit_times(self, samples: int) -> Array:
        """Times (M,) over one period without its end, which repeats the start."""
        times: Array = np.arange(samples, dtype=np.float64) / (samples * self.base_frequency)
        return times

    def shares(self, samples: int) -> tuple[float, ...]:
        """Four times cos(pi N / M) (Ehlich and Zeller 1964)."""
        return (float(np.cos(np.pi * self.harmonics / samples)),) * 4
