"""Minimal sets: which parameters the Jacobian of some poses tells apart, and what the others hide behind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

RANK_TOLERANCE = 1e-6
"""Share of a scaled column that has to be new: rounding leaves 1e-12, a motion of a hundredth of a degree 1e-4."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Reduction:
    """A choice of independent columns.

    Attributes:
        kept: numbers of the columns that are independent, in the order in which they were tried.
        dropped: numbers of the others.
        combination: each dropped column as a combination of the kept ones (len(kept), len(dropped)).
        novelty: share of each column that those before it do not explain (P,).
    """

    kept: tuple[int, ...]
    dropped: tuple[int, ...]
    combination: Array
    novelty: Array

    @property
    def rank(self) -> int:
        """Number of independent columns."""
        return len(self.kept)

    def partners(self, column: int, share: float = 0.05) -> tuple[int, ...]:
        """Names the kept columns that a dropped one cannot be told from.

        Args:
            column: number of a dropped column.
            share: of the largest coefficient, below which one does not count.
        """
        weights = np.abs(self.combination[:, self.dropped.index(column)])
        return tuple(self.kept[k] for k in np.flatnonzero(weights > share * weights.max(initial=0.0)))


def reduce_columns(
    matrix: Array, order: Sequence[int] | None = None, *, tolerance: float = RANK_TOLERANCE, shortest: float = 0.0
) -> Reduction:
    """Keeps columns one after the other if they are new (Gram and Schmidt, twice, on columns of equal length).

    Columns of zeros are dropped. The choice is that of base parameters (Khalil and Dombre 2002, section 9.4), with a
    stated order of preference.

    Args:
        matrix: (R, P), rows and columns scaled to comparable units.
        order: in which columns are tried; from first to last by default.
        tolerance: share of a column's length that has to be new.
        shortest: length of what has to be new. With rows in standard deviations of the noise and columns in usual sizes
            of the parameters, the inverse is the standard error, in usual sizes, at which nothing is determined.
    """
    rows, count = matrix.shape
    # A triangle with the same inner products is enough.
    triangle = np.linalg.qr(matrix, mode="r") if rows > count else matrix
    lengths = np.linalg.norm(triangle, axis=0)
    zero = lengths <= np.finfo(float).eps * rows * lengths.max(initial=0.0)
    unit = triangle / np.where(zero, 1.0, lengths)
    basis = np.zeros((triangle.shape[0], count))
    kept: list[int] = []
    dropped: list[int] = []
    novelty = np.zeros(count)
    for column in range(count) if order is None else order:
        if zero[column]:
            dropped.append(column)
            continue
        found = basis[:, : len(kept)]
        new = unit[:, column]
        for _ in range(2):
            new = new - found @ (found.T @ new)
        novelty[column] = np.linalg.norm(new)
        if novelty[column] > tolerance and novelty[column] * lengths[column] > shortest:
            basis[:, len(kept)] = new / novelty[column]
            kept.append(column)
        else:
            dropped.append(column)
    solved = np.linalg.lstsq(unit[:, kept], unit[:, dropped], rcond=None)[0] if kept else np.zeros((0, len(dropped)))
    scale = np.where(zero, 0.0, lengths)
    combination = solved * scale[dropped] / scale[kept][:, None] if kept else solved
    return Reduction(kept=tuple(kept), dropped=tuple(dropped), combination=combination, novelty=novelty)
