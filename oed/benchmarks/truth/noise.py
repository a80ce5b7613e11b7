"""Measurement noise: torque noise, half of it coloured, sometimes heavy-tailed, and encoder quantisation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter


@dataclass(frozen=True, kw_only=True)
class Noise:
    """Noise of torques and positions.

    Args:
        level: RMS of the torque noise as a fraction of each joint's torque RMS.
        memory: correlation between consecutive samples of the coloured half (n,).
        tails: degrees of freedom of Student's t, or None for a normal distribution.
        common: correlation between joints.
        counts: encoder counts per turn of the joint (n,).
    """

    level: float
    memory: np.ndarray
    tails: float | None
    common: float
    counts: np.ndarray

    def torque(self, samples: int, size: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Draws torque noise (N, n) for joints with the torque RMS ``size`` (n,) [N m]."""
        n = len(size)
        white, driven = self._draw(rng, samples, n), self._draw(rng, samples + 200, n)
        coloured = np.empty_like(driven)
        for j, rho in enumerate(self.memory):
            coloured[:, j] = lfilter([np.sqrt(1 - rho**2)], [1, -rho], driven[:, j])
        return self.level * size * np.sqrt(0.5) * (white + coloured[200:])

    def _draw(self, rng: np.random.Generator, samples: int, n: int) -> np.ndarray:
        if self.tails is None:
            own, shared = rng.normal(size=(samples, n)), rng.normal(size=(samples, 1))
        else:
            spread = np.sqrt(self.tails / (self.tails - 2))
            own = rng.standard_t(self.tails, size=(samples, n)) / spread
            shared = rng.standard_t(self.tails, size=(samples, 1)) / spread
        return np.sqrt(1 - self.common) * own + np.sqrt(self.common) * shared

    def position(self, q: np.ndarray) -> np.ndarray:
        """Returns positions (N, n) [rad] quantised by the encoders."""
        count = 2 * np.pi / self.counts
        return np.round(q / count) * count


def draw_noise(
    n: int,
    gear: np.ndarray,
    rng: np.random.Generator,
    *,
    level: float = 0.025,
    memory: tuple[float, float] = (0.7, 0.95),
) -> Noise:
    """Draws a noise: memory within a range, heavy tails in a fifth of all cases, correlation of joints up to 0.3.

    Heavy tails are Student's t with 5 degrees of freedom. Encoders have 2^17 to 2^20 counts per turn, of the motor in
    half of all cases and of the joint in the others.
    """
    counts = np.full(n, 2.0 ** rng.integers(17, 21))
    if rng.random() < 0.5:
        counts = counts * gear
    return Noise(
        level=level,
        memory=rng.uniform(*memory, n),
        tails=5.0 if rng.random() < 0.2 else None,
        common=float(rng.uniform(0.0, 0.3)),
        counts=counts,
    )
