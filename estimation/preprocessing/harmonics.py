"""Periodic motion: its period, found in the log itself, and projection on its harmonics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize_scalar

from estimation.preprocessing.base import Smoother
from estimation.preprocessing.resampling import Resampled
from estimation.uncertainty.correlations import squared_differences
from robots.signals import Motion

Array = NDArray[np.float64]

# What a period may miss of the one before, of each joint's standard deviation: a controller's tracking repeats to a
# part in a thousand, and what does not repeat is no period.
MISSED = 0.01
# Whole periods that a log must hold, and samples that a period must hold.
LEAST, SAMPLES = 2.0, 20
# A rougher sampling is enough to find the period; it is refined on all samples.
MOST_ROWS = 20_000
CHUNK = 16_384


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
        for rows in _chunks(len(t)):
            basis = self._basis(t[rows] - t[0])[0]
            gram += basis.T @ basis
            cross += basis.T @ q[rows]
        coefficients = cho_solve(cho_factor(gram), cross)
        at = positions.original
        signals = np.empty((3, len(at), q.shape[1]))
        for rows in _chunks(len(at)):
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


def period_of(positions: Resampled) -> float | None:
    """Finds the shortest period with which all joints repeat themselves, all through the log.

    Args:
        positions: on a uniform grid.

    Returns:
        The period [s], or None where less than two periods are there, or the motion does not repeat to a hundredth of
        each moving joint's standard deviation.
    """
    stride = max(1, len(positions.q) // MOST_ROWS)
    q, step = positions.q[::stride], positions.period * stride
    spread = q.std(axis=0)
    moves = spread > 1e-6 * max(1.0, float(spread.max()))
    if not moves.any() or len(q) < LEAST * SAMPLES:
        return None
    x = (q[:, moves] - q[:, moves].mean(axis=0)) / spread[moves]
    # RMS over sqrt(2) of x(t + lag) - x(t), of the worst joint.
    differences = squared_differences(x, x, np.arange(len(x) // 2 + 1))
    misses = np.sqrt(np.maximum(differences, 0.0) / 2).max(axis=1)
    longest = min(len(misses) - 1, int(len(x) / LEAST))
    if longest < SAMPLES:
        return None
    lags = np.arange(SAMPLES, longest + 1)
    # A local minimum of what a shift by the lag misses; near it the miss grows linearly, and a tenth is near.
    inner = misses[lags]
    below = (inner <= misses[lags - 1]) & (inner <= misses[np.minimum(lags + 1, len(misses) - 1)])
    for lag in lags[below & (inner < 0.1)]:
        found = _refine(x, int(lag))
        if found is not None:
            return float(found * step)
    return None


def _refine(x: Array, lag: int) -> float | None:
    """The real lag about a whole one at which the motion repeats itself best, or None where it does not."""
    place = np.arange(len(x) - lag - 2)

    def miss(shift: float) -> float:
        whole = int(np.floor(shift))
        part = shift - whole
        moved = (1 - part) * x[place + whole] + part * x[place + whole + 1]
        return float(np.sqrt(0.5 * np.mean((moved - x[place]) ** 2, axis=0)).max())

    found = minimize_scalar(miss, bounds=(lag - 1, lag + 1), method="bounded", options={"xatol": 1e-5})
    return float(found.x) if found.fun < MISSED else None


def _chunks(rows: int) -> list[slice]:
    return [slice(start, start + CHUNK) for start in range(0, rows, CHUNK)]
