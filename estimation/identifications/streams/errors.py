"""Torque errors of all rows of a large log: sums, a histogram, and stretches that are kept."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from estimation.identifications.assembly import Figures
from estimation.identifications.fit import SANDWICH_ROWS, SANDWICH_STRETCHES
from estimation.regressions.preparation import Rows
from estimation.uncertainty.quantiles import BAND_SHARE
from robots.common.arrays import Array
from robots.signals import Motion

# Bins of the errors' sizes, equal steps of their logarithm: a quantile is known to 0.1 %.
ERROR_BINS, ERROR_DECADES = 20_000, 9.0


class Errors:
    """Sums over rows that come piece by piece.

    Attributes:
        rows: number of rows.
        judged: number of rows (n,) in which the joint is not at rest.
        torque: squared torques in those (n,).
        sums: torques in those (n,).
        squares: squared errors in those (n,).
        kept: rows of the stretches that are kept, and their predicted torque.
    """

    def __init__(self, total: int, highest: Array) -> None:
        n = len(highest)
        self._scale = np.maximum(highest, np.finfo(float).tiny)
        self.rows = 0
        self.torque, self.sums, self.squares, self.judged = np.zeros((4, n))
        self.kept: list[tuple[Rows, Array]] = []
        self._second, self._seconds = np.zeros(n), 0
        self._counts = np.zeros((n, ERROR_BINS))
        self._lower, self._upper = np.full(n, np.inf), np.full(n, -np.inf)
        self._fastest, self._hardest = np.zeros((2, n))
        length = SANDWICH_ROWS // SANDWICH_STRETCHES
        self._places = [] if total <= SANDWICH_ROWS else _spread(total - length, SANDWICH_STRETCHES)
        self._length = length

    def add(self, part: Rows, predicted: Array) -> None:
        """Adds a piece.

        Args:
            part: N rows.
            predicted: torque (N, n) [N m or N].
        """
        motion, error, judged = part.motion, part.tau - predicted, part.judged
        self.torque += np.einsum("tj,tj,tj->j", part.tau, part.tau, judged)
        self.sums += np.einsum("tj,tj->j", part.tau, judged)
        self.squares += np.einsum("tj,tj,tj->j", error, error, judged)
        self.judged += judged.sum(axis=0)
        if len(error) > 2:
            second = error[2:] - 2 * error[1:-1] + error[:-2]
            self._second += np.einsum("tj,tj->j", second, second)
            self._seconds += len(second)
        self._lower = np.minimum(self._lower, motion.q.min(axis=0))
        self._upper = np.maximum(self._upper, motion.q.max(axis=0))
        self._fastest = np.maximum(self._fastest, np.abs(motion.dq).max(axis=0))
        self._hardest = np.maximum(self._hardest, np.abs(motion.ddq).max(axis=0))
        sizes = np.log10(np.maximum(np.abs(error) / self._scale, 1e-300))
        bins = np.clip(((sizes + ERROR_DECADES - 1) / ERROR_DECADES * ERROR_BINS).astype(int), 0, ERROR_BINS - 1)
        for joint in range(error.shape[1]):
            self._counts[joint] += np.bincount(bins[judged[:, joint], joint], minlength=ERROR_BINS)
        if not self._places:
            self.kept.append((part, predicted))
        for begin in self._places:
            if self.rows <= begin < self.rows + len(error):
                self._keep(part, predicted, begin - self.rows)
        self.rows += len(error)

    @property
    def figures(self) -> Figures:
        """The sums over all rows."""
        return Figures(
            rows=np.maximum(self.judged, 1),
            torque=self.torque,
            sums=self.sums,
            residual=self.squares,
            floor=self.floor,
            band=self.band,
        )

    @property
    def band(self) -> Array:
        """Half-widths (n,) that hold `BAND_SHARE` of each joint's errors; NaN where none is known."""
        total = self._counts.sum(axis=1)
        first = (np.cumsum(self._counts, axis=1) >= BAND_SHARE * total[:, None]).argmax(axis=1)
        size = self._scale * 10 ** ((first + 0.5) / ERROR_BINS * ERROR_DECADES - ERROR_DECADES + 1)
        return np.where(total > 0, size, np.nan)

    @property
    def floor(self) -> Array:
        """Noise level (n,) by the fastest part of the errors, see `fast_noise`."""
        return np.sqrt(self._second / (6 * max(self._seconds, 1)))

    @property
    def recorded(self) -> dict[str, list[list[float]]]:
        """Each joint's lowest and highest position, and largest speed and acceleration."""
        return {
            "position": [self._lower.tolist(), self._upper.tolist()],
            "velocity": [self._fastest.tolist()],
            "acceleration": [self._hardest.tolist()],
        }

    def _keep(self, part: Rows, predicted: Array, begin: int) -> None:
        """Copies some rows, so that the piece can go."""
        begin = max(0, min(begin, len(predicted) - self._length))
        at = slice(begin, begin + self._length)
        motion = Motion(*(getattr(part.motion, name)[at].copy() for name in ("t", "q", "dq", "ddq")))
        rest = None if part.rest is None else part.rest[at].copy()
        rows = replace(part, motion=motion, tau=part.tau[at].copy(), mask=part.mask[at].copy(), rest=rest)
        self.kept.append((rows, predicted[at].copy()))


def _spread(last: int, count: int) -> list[int]:
    return np.linspace(0, last, count).astype(int).tolist()
