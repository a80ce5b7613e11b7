"""Moves from point to point with stops, at which friction holds a joint with any torque."""

from __future__ import annotations

import numpy as np


def moves_with_stops(
    t: np.ndarray, lower: np.ndarray, upper: np.ndarray, velocity: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Draws moves with smooth ramps of 0.15 to 0.4 s, a quarter of them of one joint, and stops of 0.2 to 5 s.

    Args:
        t: times from 0 on (N,) [s].
        lower: positions that are not left (n,).
        upper: positions that are not left (n,).
        velocity: speeds that are not exceeded (n,).
        rng: draws the moves.

    Returns:
        Positions, velocities (exactly 0 at rest) and accelerations (N, n).
    """
    n = len(lower)
    here, begin = (lower + upper) / 2, 1.0
    q, dq, ddq = np.tile(here, (len(t), 1)), np.zeros((len(t), n)), np.zeros((len(t), n))
    while begin < t[-1]:
        there = lower + rng.uniform(0.15, 0.85, n) * (upper - lower)
        if rng.random() < 0.25:
            there = np.where(np.arange(n) == rng.integers(n), here + 0.3 * (there - here), here)
        ramp, change = rng.uniform(0.15, 0.4), there - here
        length = max(2 * ramp, float(np.max(np.abs(change) / velocity)) / rng.uniform(0.3, 0.7) + ramp)
        after = t >= begin
        up, down = (_ramp(t[after] - start, ramp) for start in (begin, begin + length - ramp))
        share, speed, rate = ((a - b) / (length - ramp) for a, b in zip(up, down, strict=True))
        q[after] = here + share[:, None] * change
        dq[after], ddq[after] = speed[:, None] * change, rate[:, None] * change
        begin += length + rng.choice([rng.uniform(0.2, 1.0), rng.uniform(1.0, 5.0)])
        here = there
    dq[np.abs(dq) < 1e-9] = 0.0
    return q, dq, ddq


def held_torque(dq: np.ndarray, coulomb: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Draws the torque that friction holds at rest: another share of the Coulomb friction at each stop.

    Args:
        dq: velocities (N, n), exactly 0 at rest.
        coulomb: Coulomb friction (n,), or of each row (N, n) [N m].
        rng: draws the shares.

    Returns:
        Torques (N, n) [N m], 0 in motion.
    """
    tau = np.zeros_like(dq)
    for j in range(dq.shape[1]):
        still = dq[:, j] == 0.0
        stops = np.cumsum(np.diff(still.astype(int), prepend=0) == 1)
        share = rng.uniform(-1.0, 1.0, stops[-1] + 1)
        tau[:, j] = np.where(still, share[stops], 0.0)
    return tau * coulomb


def _ramp(t: np.ndarray, length: float) -> tuple[np.ndarray, ...]:
    """Integral, value and derivative of a smooth step from 0 to 1 of that length [s]."""
    u = np.clip(t / length, 0.0, 1.0)
    inside = (t > 0.0) & (t < length)
    area = length * (u**2 / 2 + (np.cos(2 * np.pi * u) - 1) / (4 * np.pi**2)) + np.maximum(t - length, 0.0)
    return area, u - np.sin(2 * np.pi * u) / (2 * np.pi), np.where(inside, (1 - np.cos(2 * np.pi * u)) / length, 0.0)
