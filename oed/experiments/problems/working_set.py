"""Which of the limit rows the solver has to see."""

from __future__ import annotations

import casadi
import numpy as np

from oed.experiments.problems.problem import FourierProblem
from robots.common.arrays import Array


class WorkingSet:
    """The limit rows that IPOPT sees: a coarse grid at first, then every peak that a solution passes.

    All rows of all joints would be some thousand dense-ish rows in every iteration; a few hundred are ever near active.

    Args:
        problem: the design problem.
        stride: of the coarse grid, in limit samples.
    """

    def __init__(self, problem: FourierProblem, stride: int = 25) -> None:
        self._problem = problem
        rows = problem.rows
        limited = np.isfinite(rows.upper)  # (n, R)
        coarse = np.array([index % stride == 0 for _, index in rows.labels])
        self.chosen = limited & coarse
        centre = np.where(limited, (rows.upper + np.where(limited, rows.lower, 0)) / 2, 0)
        self._half = np.where(limited, rows.upper - centre, 1.0)
        self._offset = (problem.centre[:, None] * rows.matrix[:, 0] - centre) / self._half  # z = 0 is at the centre

    def add_peaks(self, z: Array, tolerance: float) -> bool:
        """Adds the rows around each peak that exceeds its bound; returns whether there was any."""
        excess = self._problem.rows.excess(self._problem.free(z))
        blocks = excess.reshape(excess.shape[0], -1, self._problem.limit_samples)
        peak = (blocks >= np.roll(blocks, 1, 2)) & (blocks > np.roll(blocks, -1, 2)) & (blocks > tolerance)
        around = peak | np.roll(peak, 1, 2) | np.roll(peak, -1, 2)
        passed = around.reshape(excess.shape)
        self.chosen |= passed & np.isfinite(self._problem.rows.upper)
        return bool(peak.any())

    def matrix(self) -> tuple[casadi.DM, Array]:
        """Writes the rows as -1 <= A z + b <= 1."""
        matrix, scale = self._problem.rows.matrix, self._problem.scale
        blocks, offsets = [], []
        for joint, chosen in enumerate(self.chosen):
            half = self._half[joint, chosen]
            blocks.append(casadi.DM(matrix[chosen] * scale[joint] / half[:, None]))
            offsets.append(self._offset[joint, chosen])
        return casadi.diagcat(*blocks), np.concatenate(offsets)
