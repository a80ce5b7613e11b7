"""A periodic motion with its derivatives in closed form."""

from __future__ import annotations

import numpy as np

STEP = 0.004


def periodic_motion(period: float, duration: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Two joints with five harmonics of a period [s]: positions, velocities and accelerations."""
    rng = np.random.default_rng(seed)
    t = STEP * np.arange(round(duration / STEP))
    w = 2 * np.pi / period * np.arange(1, 6)
    a, b = rng.normal(size=(2, 5, 2))
    s, c = np.sin(np.outer(t, w)), np.cos(np.outer(t, w))
    return (
        s @ a + c @ b,
        c @ (a * w[:, None]) - s @ (b * w[:, None]),
        -(s @ (a * w[:, None] ** 2)) - c @ (b * w[:, None] ** 2),
    )
