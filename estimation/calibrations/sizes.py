"""How large errors of each kind are: estimated from the poses, so that errors that poses show badly stay small."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dpotri

from robots.common.arrays import Array

LARGEST, SMALLEST = 30.0, 1e-3
"""Bounds of the size of a kind, in the usual sizes of its parameters: 150 mrad and 5 urad of joint zeros."""

QUIETEST = 1e-6  # variance of rows in standard deviations of the noise; less is rounding of exact poses
SINGULAR = 1e-6  # smallest new length of a column of length one, below which equations are singular
ITERATIONS = 40
CONVERGED = 0.01


@dataclass(frozen=True, kw_only=True, eq=False)
class Normal:
    """Normal equations of least squares: columns in usual sizes, rows in standard deviations.

    Attributes:
        gram: (P, P).
        right: (P,).
        square: sum of squares of the targets.
        rows: number of them.
    """

    gram: Array
    right: Array
    square: float
    rows: int

    @classmethod
    def of(cls, matrix: Array, target: Array) -> Normal:
        """Sums rows (R, P) and targets (R,) up."""
        return cls(gram=matrix.T @ matrix, right=matrix.T @ target, square=float(target @ target), rows=len(target))

    def __add__(self, other: Normal) -> Normal:
        return Normal(
            gram=self.gram + other.gram,
            right=self.right + other.right,
            square=self.square + other.square,
            rows=self.rows + other.rows,
        )

    def __sub__(self, other: Normal) -> Normal:
        return Normal(
            gram=self.gram - other.gram,
            right=self.right - other.right,
            square=self.square - other.square,
            rows=self.rows - other.rows,
        )

    def part(self, columns: list[int]) -> Normal:
        """Takes some of the columns."""
        return Normal(
            gram=self.gram[np.ix_(columns, columns)], right=self.right[columns], square=self.square, rows=self.rows
        )


def estimate_sizes(
    normal: Normal, kinds: NDArray[np.int64], sizes: Array, noise: float = 1.0
) -> tuple[Array, float, Array]:
    """Estimates the standard deviation of each kind's parameters by their marginal likelihood (MacKay 1992, eq. 4.8).

    Args:
        normal: the equations.
        kinds: number of each column's kind (P,); -1 for columns without a prior.
        sizes: to start from (number of kinds,).
        noise: variance of the rows to start from.

    Returns:
        The sizes, the variance of the rows, and the parameters (P,).
    """
    sizes = np.clip(np.array(sizes, dtype=float), SMALLEST, LARGEST)
    free = kinds >= 0
    x = np.zeros(len(kinds))
    for _ in range(ITERATIONS):
        prior = np.where(free, 1.0 / sizes[kinds] ** 2, 0.0) if len(sizes) else np.zeros(len(kinds))
        scale = np.sqrt(np.maximum(np.diag(normal.gram) / noise + prior, np.finfo(float).tiny))
        inverse = _inverse((normal.gram / noise + np.diag(prior)) / np.outer(scale, scale)) / np.outer(scale, scale)
        x = inverse @ normal.right / noise
        determined = np.where(free, 1.0 - prior * np.diag(inverse), 1.0)
        before = sizes.copy(), noise
        for k in range(len(sizes)):
            own = kinds == k
            if own.any():
                size = np.sqrt(np.sum(x[own] ** 2) / max(float(np.sum(determined[own])), 1e-6))
                sizes[k] = np.clip(size, SMALLEST, LARGEST)
        left = normal.square - 2.0 * x @ normal.right + x @ normal.gram @ x
        noise = max(float(left), 0.0) / max(normal.rows - float(np.sum(determined)), 1.0)
        noise = max(noise, QUIETEST)
        change = np.max(np.abs(np.log(sizes / before[0])), initial=abs(np.log(noise / before[1])))
        if change < CONVERGED:
            break
    return sizes, noise, x


def _inverse(matrix: Array) -> Array:
    """Inverse of normal equations in columns of length one; the pseudo-inverse where they are singular."""
    if not matrix.size:
        return matrix
    triangle, failed = dpotrf(matrix, lower=1, clean=1)
    if failed or np.diag(triangle).min(initial=1.0) < SINGULAR:
        return np.asarray(np.linalg.pinv(matrix, hermitian=True), dtype=np.float64)
    half, _ = dpotri(triangle, lower=1)
    # Only the lower half is filled; the upper one holds zeros.
    half = half + half.T
    np.fill_diagonal(half, half.diagonal() / 2.0)
    return np.asarray(half)


def kind_numbers(kinds: list[str], names: list[str]) -> NDArray[np.int64]:
    """Number of each column's kind among `names`; -1 for those of the setup."""
    return np.array([names.index(kind) if kind in names else -1 for kind in kinds], dtype=np.int64)
