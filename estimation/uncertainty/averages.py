"""Rows of a long log averaged a few at a time: what its motion can feel of the noise, in a fraction of the rows."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robots.common.arrays import Array
from robots.common.stretches import chunks

# Rows are averaged over so much time [s], which leaves out the noise above 25 Hz.
AVERAGING_TIME = 0.02
# The deviations within groups are a small part, and every so many pieces of the rows are enough to estimate it.
DEVIATION_STRIDE = 4


@dataclass(frozen=True, eq=False)
class Averages:
    """Sums of the regressor's rows and means of the residual over groups of rows.

    The score Y'e of a fit is, group by group, the sum of the rows times the mean of the residual, plus what both
    deviate from their means within the group. A motion that is slow against a group leaves next to nothing of the
    second part; what there is has the residual's variance within the groups.

    Attributes:
        rows: number of groups M.
        mask: share of each group's rows that count (M, n).
        residual: mean over those that do (M, n).
        used: per joint the indices of the columns that act on it.
        sums: per joint its rows' sum over each group (M, p_j).
        within: per joint the Gram matrix of the rows' deviations within their groups (p_j, p_j).
        variance: of the residual within the groups (n,).
        repeats: how often the rows count.
    """

    rows: int
    mask: Array
    residual: Array
    used: Sequence[NDArray[np.intp]]
    sums: Sequence[Array]
    within: Sequence[Array]
    variance: Array
    repeats: int = 1

    @staticmethod
    def of(
        columns: Callable[[int, int], list[tuple[Array, NDArray[np.intp]]]],
        mask: Array,
        residual: Array,
        size: int,
        chunk: int,
        sums: Callable[[int, int, int], Sequence[Array]] | None = None,
    ) -> Averages:
        """Goes through the rows once.

        Args:
            columns: (start, stop) -> each joint's columns (stop - start, p_j), with their indices.
            mask: (N, n), zero where a row of a joint does not count.
            residual: (N, n), zero there.
            size: rows of a group; the last N modulo `size` are left out.
            chunk: rows held at a time.
            sums: (start, stop, size) -> each joint's columns summed over groups as they count, n arrays; None to sum
                `columns`.
        """
        groups, joints = len(mask) // size, mask.shape[1]
        counted = mask[: groups * size].reshape(groups, size, joints)
        rows = counted.sum(axis=1)
        errors = residual[: groups * size].reshape(groups, size, joints)
        means = errors.sum(axis=1) / np.maximum(rows, 1.0)
        variance = ((errors - means[:, None] * counted) ** 2).sum(axis=(0, 1)) / np.maximum(
            np.maximum(rows - 1, 0.0).sum(axis=0), 1.0
        )
        used: list[NDArray[np.intp]] = []
        totals: list[Array] = []
        within: list[Array] = []
        step = max(1, chunk // size)
        looked = 0
        for piece, begin in enumerate(range(0, groups, step)):
            end = min(begin + step, groups)
            inside = piece % DEVIATION_STRIDE == 0
            looked += (end - begin) * inside
            if sums is not None and totals and not inside:
                for total, part in zip(totals, sums(begin * size, end * size, size), strict=True):
                    total[begin:end] = part
                continue
            found = columns(begin * size, end * size)
            if not totals:
                used = [indices for _, indices in found]
                totals = [np.empty((groups, len(indices))) for indices in used]
                within = [np.zeros((len(indices), len(indices))) for indices in used]
            for joint, (Y, _) in enumerate(found):
                weight = np.ascontiguousarray(counted[begin:end, :, joint])
                part = (weight[:, None] @ Y.reshape(end - begin, size, -1))[:, 0]
                totals[joint][begin:end] = part
                if inside:
                    weighted = Y * weight.reshape(-1, 1)
                    mean = part / np.sqrt(np.maximum(rows[begin:end, joint, None], 1.0))
                    within[joint] += weighted.T @ weighted - mean.T @ mean
        return Averages(groups, rows / size, means, used, totals, [gram * groups / looked for gram in within], variance)

    def columns(self, start: int, stop: int) -> list[tuple[Array, NDArray[np.intp]]]:
        """Gives each joint's columns (stop - start, p_j) that times the mask are the sums, with their indices."""
        shares = self.mask[start:stop]
        return [
            (total[start:stop] / np.where(share > 0, share, 1.0)[:, None], indices)
            for total, indices, share in zip(self.sums, self.used, shares.T, strict=True)
        ]

    def chunks(self) -> Iterator[slice]:
        """Cuts the groups into pieces."""
        return chunks(self.rows)

    def lost(self, weights: Array, size: int) -> Array:
        """What the deviations within the groups add to the sandwich's meat (p, p).

        Args:
            weights: of the joints' rows (n,).
            size: number of parameters p.
        """
        meat = np.zeros((size, size))
        for joint, (gram, indices) in enumerate(zip(self.within, self.used, strict=True)):
            meat[np.ix_(indices, indices)] += weights[joint] ** 2 * self.variance[joint] * gram
        return meat
