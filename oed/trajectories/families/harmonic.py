"""What families of a finite Fourier series share: their size, their period, and the scale of their waves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from oed.trajectories.base import Array
from oed.trajectories.families.base import Family
from robots.common.errors import InputError


@dataclass(frozen=True, kw_only=True)
class HarmonicFamily(Family):
    """A family whose coefficients are an offset and waves of N harmonics.

    Attributes:
        harmonics: N, at least 2.
        base_frequency: of the first harmonic, one over the period [Hz].

    Raises:
        InputError: numbers out of range.
    """

    harmonics: int = 5
    base_frequency: float = 0.1

    def __post_init__(self) -> None:
        if self.harmonics < 2 or self.harmonics != int(self.harmonics):
            raise InputError(f"harmonics is {self.harmonics}", allowed="a whole number, at least 2")
        if not (np.isfinite(self.base_frequency) and self.base_frequency > 0):
            raise InputError(f"the base frequency is {self.base_frequency} Hz", allowed="a positive number")

    @classmethod
    def of_size(cls, harmonics: int, base_frequency: float) -> Self:
        """Builds the series of N harmonics."""
        return cls(harmonics=harmonics, base_frequency=base_frequency)

    @property
    def duration(self) -> float:
        """One period [s]."""
        return 1 / self.base_frequency

    def scale(self, half: Array, velocity: Array) -> Array:
        """Half the range for the offset, half the velocity limit for each wave."""
        return np.column_stack([half, np.repeat((velocity / 2)[:, None], self.size - 1, axis=1)])
