"""Zero-phase low-pass of positions, and their derivatives."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.signal import sosfiltfilt
from scipy.sparse import csr_array, diags_array
from scipy.special import binom

from estimation.preprocessing.smoothing import butterworth, differentiate

Array = NDArray[np.float64]

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
