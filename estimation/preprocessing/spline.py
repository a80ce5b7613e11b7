"""A smoothing spline through the samples where they are: for uneven time, and for the ends of a log."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline
from scipy.linalg import solveh_banded

from estimation.preprocessing.base import Smoother
from estimation.preprocessing.resampling import Resampled
from estimation.preprocessing.smoothing import own_cutoff
from robots.common.arrays import Array
from robots.signals import Motion


@dataclass(frozen=True)
class SmoothingSpline(Smoother):
    """Quintic spline that minimises sum_i (q_i - s(t_i))^2 + f_s (2 pi f_0)^-6 integral s'''^2 dt.

    It is the posterior mean of a triple integrator driven by white noise, which a Kalman smoother (Rauch, Tung,
    Striebel 1965) computes sample by sample; away from the ends it passes what `LowPass` of the same cut-off passes
    (Wahba 1990). It needs no grid: uneven samples count where they are, stale ones not at all, and at the ends it goes
    straight on instead of being mirrored.

    Attributes:
        cutoff: frequency at which it is 3 dB down [Hz].
    """

    cutoff: float
    name = "smoothing spline"

    def smooth(self, positions: Resampled) -> Motion:
        """Gives the motion at the log's own times."""
        t, q = positions.fresh_t, positions.fresh_q
        start, duration = t[0], t[-1] - t[0]
        own = own_cutoff(self.cutoff)
        # Knots per period of the cut-off: finer ones change nothing, the penalty having smoothed what they could
        # follow.
        degree = 5
        pieces = int(np.clip(np.ceil(duration * 8.0 * self.cutoff), 1, max(1, len(t) - degree)))
        width = duration / pieces
        # Time in knots, from the first sample: large clock values would cost digits.
        knots = np.arange(-degree, pieces + degree + 1, dtype=float)
        basis = BSpline.design_matrix(np.clip((t - start) / width, 0.0, pieces), knots, degree)
        normal = (basis.T @ basis).todia()
        size = pieces + degree
        banded = np.zeros((degree + 1, size))
        for offset, diagonal in zip(normal.offsets.tolist(), normal.data, strict=True):
            if 0 <= offset <= degree:
                banded[degree - offset, offset:] = diagonal[offset:size]
        rate = (len(t) - 1) / duration
        # Differences of coefficients stand for derivatives of the spline: so that both agree at the cut-off.
        # Third differences are sinc^3 of derivatives, the B-spline sinc^6: squared, and one over the other.
        agreement = np.sinc(own * width) ** 6
        weight = agreement * rate * (2 * np.pi * own) ** -6 * width**-5
        for offset, diagonal in enumerate(_third_differences(size)):
            banded[degree - offset, offset:] += weight * diagonal
        coefficients = solveh_banded(banded, np.asarray(basis.T @ q))
        spline = BSpline(knots, coefficients, degree)
        at = np.clip((positions.original - start) / width, 0.0, pieces)
        derivatives = (spline(at, nu=order) / width**order for order in (0, 1, 2))
        return Motion(positions.original, *derivatives)

    def edge(self, duration: float) -> float:
        """Time at each end [s]: half of what a filter needs, which continues with a mirror image."""
        return min(0.125 / self.cutoff, 0.05 * duration)


def _third_differences(size: int) -> list[Array]:
    """The diagonals 0 to 3 of D'D, D the third differences of `size` coefficients."""
    row = np.array([-1.0, 3.0, -3.0, 1.0])
    diagonals = []
    for offset in range(4):
        diagonal = np.zeros(size - offset)
        for place in range(4 - offset):
            diagonal[place : place + size - 3] += row[place] * row[place + offset]
        diagonals.append(diagonal)
    return diagonals
