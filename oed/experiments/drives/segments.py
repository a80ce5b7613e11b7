"""Pieces of a motion for drives: sines, chirps, squares, steps, ramps and holds, from home back to home."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

KINDS = ("sine", "chirp", "square", "steps", "multisine", "ramps", "holds")
BLEND = 0.08
"""Share of a segment at each end in which it leaves home and comes back."""


def chirp(t: Array, n: int, slowest: float, fastest: float) -> Array:
    """Writes sines of growing frequency, one joint a quarter of a period after the other (N, n), between -1 and 1."""
    end = t[-1] - t[0]
    phase = 2 * np.pi * (slowest * t + (fastest - slowest) * t**2 / (2 * end))
    return np.asarray(np.sin(phase[:, None] + 0.5 * np.pi * np.arange(n)) * window(t)[:, None])


def window(t: Array) -> Array:
    """Weights (N,) that rise from zero and fall to zero, smoothly."""
    share = (t - t[0]) / (t[-1] - t[0])
    rise = np.clip(np.minimum(share, 1 - share) / BLEND, 0, 1)
    return np.asarray(rise**2 * (3 - 2 * rise))


def candidates(t: Array, n: int, fastest: float, count: int, rng: np.random.Generator) -> Iterator[tuple[str, Array]]:
    """Draws segments of all kinds, each (N, n) between -1 and 1 of the joints' reach.

    Args:
        t: times (N,) [s].
        n: number of joints.
        fastest: highest frequency [Hz].
        count: how many.
        rng: draws them.
    """
    length = t[-1] - t[0]
    for k in range(count):
        kind = KINDS[k % len(KINDS)]
        size = rng.choice([1.0, 1.0, 0.5])
        shared = np.exp(rng.uniform(np.log(1 / length), np.log(fastest)))
        wave = np.empty((len(t), n))
        for j in range(n):
            if kind == "multisine":
                frequencies = np.geomspace(1 / length, fastest, 6) * rng.uniform(0.9, 1.1, 6)
                own = np.sin(2 * np.pi * np.outer(t, frequencies) + rng.uniform(0, 2 * np.pi, 6))
                own = own @ (rng.uniform(0.3, 1.0, 6) / np.sqrt(frequencies))
            elif kind == "chirp":
                low, high = np.sort(np.exp(rng.uniform(np.log(1 / length), np.log(fastest), 2)))
                own = np.sin(2 * np.pi * (low * t + (high - low) * t**2 / (2 * length)) + rng.uniform(0, 2 * np.pi))
            elif kind in ("sine", "square"):
                own = np.sin(2 * np.pi * shared * rng.uniform(0.9, 1.1) * t + rng.uniform(0, 2 * np.pi))
                own = own if kind == "sine" else np.clip(20 * own, -1, 1)
            elif kind == "steps":
                levels = rng.uniform(-1, 1, max(2, round(length / rng.uniform(0.2, 0.5))))
                own = levels[np.minimum((np.arange(len(t)) * len(levels)) // len(t), len(levels) - 1)]
            elif kind == "ramps":
                own = 2 * np.abs(2 * ((t / length * rng.integers(1, 4) + rng.uniform()) % 1) - 1) - 1
            else:
                levels = rng.uniform(-1, 1, 3)
                own = np.interp(t / length, [0, 0.25, 0.3, 0.6, 0.65, 1], np.repeat(levels, 2))
            wave[:, j] = own / max(float(np.abs(own).max()), 1e-9)
        yield kind, size * wave * window(t)[:, None]
