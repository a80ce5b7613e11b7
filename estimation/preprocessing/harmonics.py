"""Periodic motion: projection on the harmonics of its period."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from estimation.preprocessing.base import Smoother
from estimation.preprocessing.resampling import Resampled
from robots.common.arrays import Array
from robots.common.stretches import chunks
from robots.signals import Motion


@dataclass(frozen=True)
class Harmonics(Smoother):
    """Projects positions on a constant and the harmonics of one period, and differentiates those in closed form.

    Least squares on all periods is the projection of their average: noise falls with the number of periods and
    with the share of the spectrum that the harmonics leave out, and nothing is lost at the ends (Swevers et al. 1997).

    Attributes:
        period: [s].
        order: the highest harmonic.
    """

    ENTRIES = ("kind=name", "cutoff_hz=cutoff", "period_s=period", "harmonics=order")

    period: float
    order: int
    name = "harmonics"

    @property
    def cutoff(self) -> float:  # type: ignore[override]
        """The highest harmonic's frequency [Hz]."""
        return self.order / self.period

    def smooth(self, positions: Resampled) -> Motion:
        """Gives the motion at the log's own times."""
        t, q = positions.fresh_t, positions.fresh_q
        size = 2 * self.order + 1
        gram, cross = np.zeros((size, size)), np.zeros((size, q.shape[1]))
        for rows in chunks(len(t)):
            basis = self._basis(t[rows] - t[0])[0]
            gram += basis.T @ basis
            cross += basis.T @ q[rows]
        coefficients = cho_solve(cho_factor(gram), cross)
        at = positions.original
        signals = np.empty((3, len(at), q.shape[1]))
        for rows in chunks(len(at)):
            for signal, basis in zip(signals, self._basis(at[rows] - t[0], derivatives=2), strict=True):
                signal[rows] = basis @ coefficients
        return Motion(at, *signals)

    def edge(self, duration: float) -> float:
        """No time is lost at the ends [s]."""
        return 0.0

    @property
    def text(self) -> str:
        """Says what it does in a few words."""
        return f"projection on {self.order} harmonics of the period of {self.period:.6g} s"

    def _basis(self, t: Array, derivatives: int = 0) -> list[Array]:
        w = 2 * np.pi / self.period * np.arange(1, self.order + 1)
        angles = np.outer(t, w)
        s, c = np.sin(angles), np.cos(angles)
        one, zero = np.ones((len(t), 1)), np.zeros((len(t), 1))
        stages = [np.hstack([one, s, c]), np.hstack([zero, w * c, -w * s]), np.hstack([zero, -(w**2) * s, -(w**2) * c])]
        return stages[: derivatives + 1]
