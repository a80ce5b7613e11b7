"""How much noise the smoothed motion still carries, from the recorded positions themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from estimation.preprocessing import resample
from estimation.preprocessing.base import Smoother
from estimation.preprocessing.resampling import Resampled
from estimation.regressions.moments import Array
from estimation.regressions.regression_data import RegressionData

# Differences of this order leave nothing of a motion that is sampled well, and of white noise a known multiple.
DIFFERENCE_ORDER = 4


def white_position_noise(t: Array, q: Array) -> Array:
    """Estimates the standard deviation of white noise in positions, from differences of the fourth order (n,).

    Encoder steps count as the noise that they are while a joint moves by more than a step a sample. Where samples are
    missing, or late, a difference is one of the motion: those are left out, and the largest of the others.

    Args:
        t: times (N,) [s].
        q: positions (N, n).
    """
    if len(t) <= DIFFERENCE_ORDER:
        return np.zeros(q.shape[1])
    steps = np.lib.stride_tricks.sliding_window_view(np.diff(t), DIFFERENCE_ORDER)
    # Steps of time that differ by no more than 2 % count as even; a log with fewer than 10 % even windows is put on a
    # grid first.
    even = np.ptp(steps, axis=1) <= 0.02 * np.median(steps)
    if even.mean() < 0.1:
        return white_position_noise(*_on_grid(t, q))
    squares = np.sort(np.diff(q, n=DIFFERENCE_ORDER, axis=0)[even] ** 2, axis=0)
    kept = squares[: max(1, round(0.95 * len(squares)))]
    # Without its largest 5 %, the mean square of a normal variable is 0.7588 of the whole; the squared binomial
    # coefficients of order 4 sum to 70.
    return np.asarray(np.sqrt(kept.mean(axis=0) / (0.7588 * 70.0)))


def _on_grid(t: Array, q: Array) -> tuple[Array, Array]:
    positions = resample(t, q)
    return positions.t, positions.q


def passed_noise(smoother: Smoother, positions: Resampled, seed: int = 0) -> Array:
    """Finds the covariance (3, 3) of q, dq, ddq that white position noise of variance 1 leaves after the smoothing.

    Smoothers are linear: noise alone, drawn and smoothed, says what they leave of it.

    Args:
        smoother: what made the motion.
        positions: whose times count; their values don't.
        seed: of the noise.
    """
    rows = min(len(positions.t), 20_000)
    noise = np.random.default_rng(seed).standard_normal((rows, 8))
    t = positions.t[:rows]
    motion = smoother.smooth(replace(positions, t=t, q=noise, original=t))
    inside = smoother.inside(t)
    left = np.stack([signal[inside].reshape(-1) for signal in (motion.q, motion.dq, motion.ddq)])
    return np.asarray(left @ left.T / left.shape[1])


def smoothed_noise(data: RegressionData) -> Array:
    """Estimates the covariance (n, 3, 3) of the noise in each joint's smoothed q, dq, ddq; zeros without records."""
    n = data.robot.n
    total, rows = np.zeros((n, 3, 3)), 0
    if data.smoother is None:
        return total
    for log in data.logs:
        variance = white_position_noise(log.t, log.q) ** 2
        total += len(log) * variance[:, None, None] * passed_noise(data.smoother, resample(log.t, log.q))
        rows += len(log)
    return total / max(rows, 1)
