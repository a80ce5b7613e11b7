"""Minimal sets: which parameters the Jacobian of some poses distinguishes, and what the others hide behind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robots.common.arrays import Array

RANK_TOLERANCE = 1e-6
"""Share of a scaled column that has to be new: rounding leaves 1e-12, a motion of a hundredth of a degree 1e-4."""


HALF = 0.5  # of the longest new part: above it the order decides which column is kept


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
        """Names the kept columns that a dropped one cannot be distinguished from.

        Args:
            column: number of a dropped column.
            share: of the largest coefficient, below which one does not count.
        """
        weights = np.abs(self.combination[:, self.dropped.index(column)])
        return tuple(self.kept[k] for k in np.flatnonzero(weights > share * weights.max(initial=0.0)))


def reduce_columns(
    matrix: Array,
    groups: Sequence[Sequence[int]] | None = None,
    *,
    tolerance: float = RANK_TOLERANCE,
    shortest: float = 0.0,
) -> Reduction:
    """Keeps columns one after the other if they are new (Gram and Schmidt on columns in usual sizes).

    Groups come in order of preference. Within a group the first column is taken whose new part is at least half as long
    as the longest one: a set that is well conditioned also where axes are only nearly parallel. Columns of zeros are
    dropped. The choice is that of base parameters (Khalil and Dombre 2002, section 9.4) with a stated preference.

    Args:
        matrix: (R, P), rows and columns scaled to comparable units.
        groups: numbers of the columns by group; one group by default. Columns in no group are not looked at.
        tolerance: share of a column's length that has to be new.
        shortest: length of what has to be new. With rows in standard deviations of the noise and columns in usual sizes
            of the parameters, the inverse is the standard error, in usual sizes, at which nothing is determined.
    """
    rows, count = matrix.shape
    # A triangle with the same inner products is enough.
    triangle = np.asarray(np.linalg.qr(matrix, mode="r")) if rows > count else np.array(matrix)
    lengths = np.linalg.norm(triangle, axis=0)
    least = np.maximum(tolerance * lengths, np.finfo(float).eps * rows * lengths.max(initial=0.0))
    least = np.maximum(least, shortest)
    kept: list[int] = []
    dropped: list[int] = []
    novelty = np.zeros(count)
    new = triangle.copy()
    basis = np.zeros((triangle.shape[0], 0))
    for group in groups if groups is not None else [range(count)]:
        left = list(group)
        while left:
            size = np.linalg.norm(new[:, left], axis=0)
            novelty[left] = size / np.where(lengths[left] > 0.0, lengths[left], 1.0)
            open_ = np.where(size > least[left], size, 0.0)
            if not open_.any():
                break
            column = left.pop(int(np.argmax(open_ >= HALF * open_.max())))
            direction = new[:, column] / np.linalg.norm(new[:, column])
            direction -= basis @ (basis.T @ direction)
            direction /= np.linalg.norm(direction)
            basis = np.column_stack([basis, direction])
            new -= np.outer(direction, direction @ new)
            kept.append(column)
        dropped += left
    scale = np.where(lengths > 0.0, lengths, 1.0)
    unit = triangle / scale
    solved = np.linalg.lstsq(unit[:, kept], unit[:, dropped], rcond=None)[0] if kept else np.zeros((0, len(dropped)))
    combination = solved * scale[dropped] / scale[kept][:, None]
    return Reduction(kept=tuple(kept), dropped=tuple(dropped), combination=combination, novelty=novelty)
