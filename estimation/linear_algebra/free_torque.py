"""Torque of any course in some stretches of rows, projected out of white columns: sparse columns, a banded factor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, solve_triangular
from scipy.sparse import csc_matrix

from robots.common.arrays import Array

Real = TypeVar("Real", np.float32, np.float64)
Piece = tuple[int, Array]


@dataclass(frozen=True, eq=False)
class FreeTorque:
    """The span of white columns that are not zero in a few rows each, in the order of those rows.

    Where filters are long and stretches close, each one's rows are its neighbours' too, from the first to the last: an
    orthonormal basis would have no zeros left. The columns' inner products are a banded matrix instead.

    Attributes:
        columns: (N, f), independent.
        factor: the lower Cholesky factor of their inner products, by diagonals (width, f).
    """

    columns: csc_matrix
    factor: Array

    def projected_out(self, white: NDArray[Real]) -> NDArray[Real]:
        """Leaves out of columns (N,) or (N, k) what lies in the span."""
        if not self.columns.shape[1] or not white.size:
            return white
        # In double precision: columns near to each other make much of rounding.
        values = cho_solve_banded((self.factor, True), self.columns.T @ white, check_finite=False)
        # Columns that are contiguous in memory stay so.
        return np.subtract(white, (self.columns @ values).astype(white.dtype, copy=False), out=np.empty_like(white))


def span_of(pieces: Sequence[Piece], rows: int) -> FreeTorque:
    """Builds the span of the columns of pieces, (first row, values (m, k)) each, in any order.

    Of each piece, the one that begins first first, those combinations stay that are not zero beside the pieces before:
    the eigenvalues of its Schur complement show it.
    """
    kept: list[Piece] = []
    lines: list[tuple[int, Array]] = []  # of the factor: the first column that is not zero, and values up to the last
    near: list[tuple[int, Piece]] = []  # pieces from the first whose rows reach the next one's, and their first column
    for row, values in sorted(pieces, key=lambda piece: piece[0]):
        norms = np.linalg.norm(values, axis=0)
        unit = values / np.where(norms > 0, norms, 1.0)
        while near and near[0][1][0] + len(near[0][1][1]) <= row:
            near.pop(0)
        first = near[0][0] if near else len(lines)
        cross = np.concatenate([np.zeros((0, unit.shape[1])), *(_products(piece, (row, unit)) for _, piece in near)])
        known = solve_triangular(_window(lines, first), cross, lower=True) if len(cross) else cross
        gram = unit.T @ unit
        left, turned = np.linalg.eigh(gram - known.T @ known)
        # Functions that are equal within the band, of one part or of its neighbours, count once.
        distinct = left > 1e-4 * np.linalg.eigvalsh(gram)[-1]
        if not distinct.any():
            continue
        turned, known = turned[:, distinct], known @ turned[:, distinct]
        near.append((len(lines), (row, unit @ turned)))
        kept.append(near[-1][1])
        for k, size in enumerate(np.sqrt(left[distinct])):
            lines.append((first, np.concatenate([known[:, k], np.zeros(k), [size]])))
    width = max((len(line) for _, line in lines), default=1)
    factor = np.zeros((width, len(lines)))
    for at, (first, line) in enumerate(lines):
        factor[at - np.arange(first, at + 1), np.arange(first, at + 1)] = line
    return FreeTorque(_sparse(kept, rows), factor)


def _products(first: Piece, second: Piece) -> Array:
    """Inner products (k1, k2) of the columns of a piece with those of one that begins no earlier."""
    shift = second[0] - first[0]
    shared = max(min(len(first[1]) - shift, len(second[1])), 0)
    return first[1][shift : shift + shared].T @ second[1][:shared]


def _window(lines: Sequence[tuple[int, Array]], first: int) -> Array:
    """The factor's last rows and columns, from a column on."""
    size = len(lines) - first
    result = np.zeros((size, size))
    for at, (start, line) in enumerate(lines[first:]):
        begin = max(start, first)
        result[at, begin - first : at + 1] = line[begin - start :]
    return result


def _sparse(pieces: Sequence[Piece], rows: int) -> csc_matrix:
    """Puts pieces side by side."""
    if not pieces:
        return csc_matrix((rows, 0))
    data = np.concatenate([values.T.ravel() for _, values in pieces])
    indices = np.concatenate([np.tile(np.arange(row, row + len(values)), values.shape[1]) for row, values in pieces])
    lengths = np.concatenate([np.full(values.shape[1], len(values)) for _, values in pieces])
    return csc_matrix((data, indices, np.concatenate([[0], np.cumsum(lengths)])), shape=(rows, len(lengths)))
