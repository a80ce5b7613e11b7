"""Projection of a periodic motion on the harmonics that exceed the variation between its periods."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from estimation.preprocessing import Cycle

Array = NDArray[np.float64]

# Power over its error from which a harmonic is significant.
STANDS_OUT = 4.0


def project_on_harmonics(q: Array, step: float, cycle: Cycle) -> tuple[tuple[Array, Array, Array], Array, Array]:
    """Projects the periodic rows on the harmonics that exceed the variation between periods.

    Args:
        q: positions (N, n) on the grid [rad or m].
        step: sample period of the grid [s].
        cycle: the rows that repeat.

    Returns:
        q, dq and ddq (stop - start, n) in the rows of the cycle, with noise removed; the highest frequency kept (n,)
        [Hz]; the power density of the noise that remains in the mean over repetitions (n,) [rad^2/Hz or m^2/Hz].
    """
    rows = np.arange(cycle.start, cycle.stop)
    times = (rows - cycle.start) * step
    samples = max(8, round(cycle.period / step))
    grid = cycle.period / samples * np.arange(samples * cycle.count)
    grid = grid[grid <= times[-1] + 0.5 * step]
    part = CubicSpline(times, q[rows])(grid)
    whole = len(part) // samples
    passes = np.fft.rfft(part[: whole * samples].reshape(whole, samples, -1), axis=1) / samples
    mean = passes.mean(axis=0)  # (H, n)
    scatter = (np.abs(passes - mean) ** 2).sum(axis=0) / max(whole - 1, 1) / whole
    # Average over neighbouring harmonics: few periods determine the noise of a single one poorly.
    scatter = _averaged(scatter)
    # An encoder rounds each pass alike, so that its errors repeat. The upper end of the band contains no motion and
    # shows them.
    top = slice(-max(4, len(mean) // 4), None)
    scatter = np.maximum(scatter, np.median(np.abs(mean[top]) ** 2, axis=0))
    kept = mean * np.clip(1.0 - scatter / np.maximum(np.abs(mean) ** 2, 1e-300), 0.0, 1.0)
    lost = _first_lost(np.abs(mean) ** 2 > STANDS_OUT * scatter)
    kept[lost[None, :] <= np.arange(len(kept))[:, None]] = 0.0
    kept[0] = mean[0]
    omega = 2 * np.pi / cycle.period * np.arange(len(kept))[:, None]
    signals = [np.fft.irfft(kept * factor * samples, samples, axis=0) for factor in (1.0, 1j * omega, -(omega**2))]
    knots = cycle.period / samples * np.arange(samples + 1)
    phase = np.mod(times, cycle.period)
    closed = [CubicSpline(knots, np.vstack([s, s[:1]]), bc_type="periodic")(phase) for s in signals]
    return (closed[0], closed[1], closed[2]), lost / cycle.period, 2 * cycle.period * np.median(scatter[top], axis=0)


def _averaged(power: Array, width: int = 15) -> Array:
    padded = np.pad(power, ((width // 2, width // 2), (0, 0)), mode="edge")
    sums = np.cumsum(np.vstack([np.zeros((1, power.shape[1])), padded]), axis=0)
    return (sums[width:] - sums[:-width]) / width


def _first_lost(stands_out: NDArray[np.bool_], allowed: int = 3) -> NDArray[np.intp]:
    """Returns per joint (n,) the harmonic from which on more than `allowed` in a row are not significant."""
    count, joints = stands_out.shape
    result = np.full(joints, count)
    for j in range(joints):
        silent = 0
        for h in range(1, count):
            silent = 0 if stands_out[h, j] else silent + 1
            if silent > allowed:
                result[j] = h - allowed
                break
    return result
