"""Motion from positions: zero-phase low-pass, projection on harmonics, and derivatives without encoder lines."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, CubicSpline
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.signal import sosfiltfilt
from scipy.sparse import csr_array, diags_array
from scipy.special import binom

from estimation.preprocessing import Cycle
from estimation.preprocessing.smoothing import butterworth, differentiate
from robots.common.arrays import Array
from robots.common.stretches import spans

ORDER = 8
# The position before a log begins is unknown, and a filter's guess of it rings for about ten periods of the cut-off.
# Within `FREE` of the ends, a smoothing spline of the same response is used instead. It blends into the filter over
# `BLENDED`.
FREE, BLENDED = 12.0, 6.0  # [periods of the cut-off]
DEGREE = 7
KNOTS = 6.0  # per period of the cut-off


def smooth_motion(x: Array, period: float, cutoffs: Array) -> tuple[Array, Array, Array]:
    """Low-passes positions (N, n) without phase lag and differentiates them.

    Args:
        x: positions (N, n) on a uniform grid [rad or m].
        period: sample period of the grid [s].
        cutoffs: cut-off of each joint (n,) [Hz]; a joint with zero or less becomes zero.

    Returns:
        Positions, velocities and accelerations (N, n).
    """
    q = np.zeros_like(x)
    for j, cutoff in enumerate(cutoffs):
        if cutoff <= 0:
            continue
        sections = butterworth(ORDER, min(float(cutoff) * 2 * period, 0.99))
        padding = min(len(x) - 1, round(12 / (cutoff * period)))
        q[:, j] = sosfiltfilt(sections, x[:, j], padtype="odd", padlen=padding)
    states = (q, *differentiate(q, period))
    for j, cutoff in enumerate(cutoffs):
        if cutoff <= 0:
            continue
        rows = min(len(x), int((FREE + BLENDED) / (cutoff * period)) + 1)
        weight = _step((np.arange(rows) * period * cutoff - FREE) / BLENDED)
        ends = _free(np.column_stack([x[:rows, j], x[len(x) - rows :, j]]), period, float(cutoff))
        for state, (first, last) in zip(states, (both.T for both in ends), strict=True):
            column = state[:, j]
            column[:rows] = first + weight * (column[:rows] - first)
            column[len(x) - rows :] = last + weight[::-1] * (column[len(x) - rows :] - last)
    return states


def low_pass_gain(f: Array, cutoff: float) -> Array:
    """Returns the gain of the low-pass, applied forward and backward, at frequencies (F,) [Hz]."""
    return np.asarray(1.0 / (1.0 + (f / cutoff) ** (2 * ORDER)))


def _free(x: Array, period: float, cutoff: float) -> tuple[Array, Array, Array]:
    """Fits smoothing splines to positions (N, k) and evaluates them with two derivatives.

    The penalty acts on differences of the B-spline coefficients (Eilers and Marx 1996), of the same order as the
    filter. It is scaled to halve the signal at the cut-off. In the middle of a log the response equals that of the
    filter applied forward and backward, 1 / (1 + (f / fc)^16). Nothing is assumed beyond the ends.
    """
    knots, design, factor = _spline(len(x), period, cutoff)
    curve = BSpline(knots, cho_solve_banded((factor, False), np.asarray(design.T @ x)), DEGREE)
    t = np.arange(len(x)) * period
    return curve(t), curve(t, 1), curve(t, 2)


@lru_cache(maxsize=16)
def _spline(rows: int, period: float, cutoff: float) -> tuple[Array, csr_array, Array]:
    """Builds knots, design matrix, and the banded Cholesky factor of the normal equations."""
    length = (rows - 1) * period
    spans = int(np.clip(np.ceil(length * cutoff * KNOTS), ORDER + 1, max(rows - 1, ORDER + 1)))
    width = length / spans
    knots = np.asarray(width * np.arange(-DEGREE, spans + DEGREE + 1), dtype=np.float64)
    t = np.arange(rows) * period
    design = BSpline.design_matrix(np.minimum(t, length * (1 - 1e-12)), knots, DEGREE)
    size = spans + DEGREE
    signs = [(-1.0) ** k * binom(ORDER, k) for k in range(ORDER + 1)]
    differences = diags_array(signs, offsets=range(ORDER + 1), shape=(size - ORDER, size)).tocsr()
    # At the cut-off, penalty and data term are equal. The B-splines attenuate the data term there, hence the sinc.
    passed = width / period * np.sinc(cutoff * width) ** (2 * DEGREE + 2)
    strength = passed / (2 * np.sin(np.pi * cutoff * width)) ** (2 * ORDER)
    normal = (design.T @ design + strength * (differences.T @ differences)).tocsr()
    bands = np.zeros((ORDER + 1, size))
    for k in range(ORDER + 1):
        bands[ORDER - k, k:] = normal.diagonal(k)
    return knots, design, cholesky_banded(bands)


def _step(x: Array) -> Array:
    """Rises from 0 to 1 over the unit interval, with two continuous derivatives."""
    x = np.clip(x, 0.0, 1.0)
    return x**3 * (10 - 15 * x + 6 * x**2)


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


CRUISE = 0.4
"""Time [s] before and after a row for which the speed must be constant."""

STRAIGHT = 1.5
"""Second difference of the position over `CRUISE` [encoder steps] up to which the speed counts as constant."""


def remove_encoder_lines(q: Array, dq: Array, ddq: Array, counts: Array, step: float) -> tuple[Array, Array]:
    """Removes the spectral lines of encoder steps from velocities and accelerations (N, n) at constant speed.

    At constant speed, encoder steps alias to a few fixed frequencies. A spectrum cannot separate these lines from
    motion. Times the inertia of a heavy arm they are a large torque. Where the second difference of the position over
    `CRUISE` is at most `STRAIGHT` encoder steps, derivatives are therefore replaced by differences over `CRUISE`. These
    neglect less motion than one encoder step.

    Args:
        q: positions (N, n) [rad or m] of one log.
        dq: velocities (N, n) [rad/s or m/s].
        ddq: accelerations (N, n) [rad/s2 or m/s2].
        counts: encoder step of each joint (n,) [rad or m]; zero if it shows none.
        step: sample period [s].

    Returns:
        Velocities and accelerations (N, n).
    """
    lag = round(CRUISE / step)
    dq, ddq = dq.copy(), ddq.copy()
    if len(q) <= 2 * lag:
        return dq, ddq
    for j in np.flatnonzero(counts > 0):
        ahead, here, behind = q[2 * lag :, j], q[lag:-lag, j], q[: -2 * lag, j]
        bend = ahead - 2 * here + behind
        for start, stop in spans(np.abs(bend) <= STRAIGHT * counts[j]):
            if stop - start > lag // 4:  # shorter stretches are zero crossings of the acceleration
                rows = slice(start + lag, stop + lag)
                dq[rows, j] = (ahead - behind)[start:stop] / (2 * lag * step)
                ddq[rows, j] = bend[start:stop] / (lag * step) ** 2
    return dq, ddq
