"""Contiguous blocks of the data, side by side: each is predicted from all the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from estimation.regressions.moments import Moments, solve_all
from estimation.regressions.parameter_priors import GaussianPrior
from robots.common.arrays import Array


@dataclass(frozen=True, eq=False)
class Blocks:
    """Normal equations of B blocks with n joints and p columns.

    A fit without one block has the sum's normal equations less the block's own: no row is looked at twice.

    Attributes:
        gram: (n, B, p, p).
        cross: (n, B, p).
        square: (n, B).
        count: (n, B) rows.
    """

    gram: Array
    cross: Array
    square: Array
    count: Array

    @staticmethod
    def empty(joints: int, blocks: int, columns: int) -> Blocks:
        """Gives blocks without rows, to be filled."""
        shape = (joints, blocks)
        gram, cross = np.zeros((*shape, columns, columns)), np.zeros((*shape, columns))
        return Blocks(gram, cross, np.zeros(shape), np.zeros(shape))

    def scaled(self, factor: Array) -> Blocks:
        """Gives the normal equations of the torques times a factor (n,)."""
        return Blocks(self.gram, self.cross * factor[:, None, None], self.square * factor[:, None] ** 2, self.count)

    @cached_property
    def total(self) -> Moments:
        """The normal equations of all blocks together."""
        return Moments(*(array.sum(axis=1) for array in (self.gram, self.cross, self.square, self.count)))

    def fitted(self, choices: NDArray[np.intp], ridge: float, pull: GaussianPrior | None) -> Array:
        """Fits several choices of as many columns each, every joint's rows counting alike.

        Args:
            choices: indices (K, k) of the columns.
            ridge: see `Moments.solve`.
            pull: what the ridge pulls to; None for zero.

        Returns:
            Parameters (K, p), zero where a column is not chosen.
        """
        gram, cross, square = self._joined(choices)
        values = np.zeros((len(choices), self.cross.shape[2]))
        np.put_along_axis(values, choices, solve_all(gram, cross, square, ridge, pull), axis=1)
        return values

    def _joined(self, choices: NDArray[np.intp]) -> tuple[Array, Array, Array]:
        """The chosen columns' normal equations of all joints in one; they are asked for with many ridges."""
        key = choices.tobytes()
        if key not in self._kept:
            gram, cross = self.total.gram.sum(axis=0), self.total.cross.sum(axis=0)
            square = np.full(len(choices), self.total.square.sum())
            self._kept.clear()
            self._kept[key] = gram[choices[:, :, None], choices[:, None, :]], cross[choices], square
        return self._kept[key]

    @cached_property
    def _kept(self) -> dict[bytes, tuple[Array, Array, Array]]:
        return {}

    def columns(self, chosen: Sequence[int]) -> Blocks:
        """Keeps some of the columns; the latest choice is remembered, for settings differ in it rarely."""
        key = tuple(chosen)
        if key not in self._chosen:
            place = np.asarray(key, dtype=np.intp)
            gram = self.gram[:, :, place[:, None], place]
            self._chosen.clear()
            self._chosen[key] = Blocks(gram, self.cross[:, :, place], self.square, self.count)
        return self._chosen[key]

    @cached_property
    def _chosen(self) -> dict[tuple[int, ...], Blocks]:
        return {}

    def without(self, weights: Array, ridge: float, pull: GaussianPrior | None) -> Array:
        """Fits all blocks but one, for each of them.

        Args:
            weights: of each joint's rows (n,).
            ridge: see `Moments.solve`.
            pull: what the ridge pulls to; None for zero.

        Returns:
            Parameters (B, p): those that the other blocks give; of a single block its own.
        """
        joints, blocks, columns = self.cross.shape
        gram = (weights @ self.gram.reshape(joints, -1)).reshape(blocks, columns, columns)
        cross, square = (weights @ self.cross.reshape(joints, -1)).reshape(blocks, columns), weights @ self.square
        if blocks > 1:
            gram, cross, square = (array.sum(axis=0) - array for array in (gram, cross, square))
        return solve_all(gram, cross, square, ridge, pull)

    def squares(self, values: Array) -> Array:
        """Sums each joint's squared errors (n,) over the blocks, each predicted by its own parameters (B, p)."""
        return np.asarray(self.squares_by_block(values).sum(axis=1))

    def squares_by_block(self, values: Array) -> Array:
        """Sums each joint's squared errors in each block (n, B), predicted by its own parameters (B, p)."""
        columns = values[:, :, None]
        quadratic = (values[:, None, :] @ (self.gram @ columns))[..., 0, 0]
        linear = (self.cross[:, :, None, :] @ columns)[..., 0, 0]
        return np.asarray(np.maximum(self.square - 2 * linear + quadratic, 0.0))


@dataclass(frozen=True, eq=False)
class Sides:
    """Blocks for a fit, and for the validation of a prediction.

    A joint almost at rest has friction of unknown sign, and its rows do not count in a fit. A prediction is needed
    there as well, and its error at the start of motions depends most on the smoothing. Rows left out of the fit
    therefore count in its validation.

    Attributes:
        fitted: of the rows that count.
        judged: of all rows in which the joint is not at rest, also those at the logs' ends.
    """

    fitted: Blocks
    judged: Blocks

    @staticmethod
    def empty(joints: int, blocks: int, columns: int) -> Sides:
        """Gives both without rows, to be filled."""
        return Sides(Blocks.empty(joints, blocks, columns), Blocks.empty(joints, blocks, columns))


def side_products(
    sums: Array,
    left_out: Sequence[tuple[NDArray[np.intp], Array]],
    size: int,
) -> list[Array]:
    """Multiplies the columns of rows that are averaged so many at a time with each other.

    Args:
        sums: of each group of `size` rows of one joint (G, k), all rows counting alike.
        left_out: of each side which groups have rows that do not count (P,), ascending, and the sum of these rows
            (P, k); what is left of such an average is still an equation.
        size: rows of a group.

    Returns:
        (k, k) of each side.
    """
    touched = np.unique(np.concatenate([places for places, _ in left_out]))
    whole = sums[touched]
    sums[touched] = 0.0
    common = sums.T @ sums
    found = []
    for places, lost in left_out:
        own = whole.copy()
        own[np.searchsorted(touched, places)] -= lost
        found.append((common + own.T @ own) / size**2)
    return found
