"""Torque of any course in some stretches is projected out as a dense orthonormal basis does it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from estimation.linear_algebra.free_torque import Piece, span_of

Array = NDArray[np.float64]

ROWS = 600


def _pieces(spacing: int, lengths: tuple[int, ...]) -> list[Piece]:
    """Three bumps a stretch, some longer than others so that a later one may end before an earlier one."""
    rng = np.random.default_rng(0)
    pieces: list[Piece] = []
    for k, row in enumerate(range(3, ROWS - max(lengths), spacing)):
        x = np.linspace(-1, 1, lengths[k % len(lengths)])
        bumps = np.exp(-6 * x[:, None] ** 2) * np.polynomial.legendre.legvander(x, 2)
        pieces.append((row, bumps * rng.uniform(0.5, 100.0, 3)))
    return pieces


def _dense(pieces: list[Piece]) -> Array:
    result = np.zeros((ROWS, sum(values.shape[1] for _, values in pieces)))
    at = 0
    for row, values in pieces:
        result[row : row + len(values), at : at + values.shape[1]] = values
        at += values.shape[1]
    return result


@pytest.mark.parametrize("spacing", [5, 17, 60])
@pytest.mark.parametrize("lengths", [(40,), (60, 20, 35)])
def test_what_is_left_is_what_a_dense_basis_leaves(spacing: int, lengths: tuple[int, ...]) -> None:
    """Stretches that touch several of their neighbours' rows, or none."""
    pieces = _pieces(spacing, lengths)
    columns = _dense(pieces)
    rng = np.random.default_rng(1)
    series = rng.standard_normal((ROWS, 4)) + columns @ rng.standard_normal((columns.shape[1], 4))
    span = span_of([*pieces[1::2], *pieces[::2]], ROWS)
    left = span.projected_out(series)
    own = np.asarray(span.columns.todense())
    basis = np.linalg.qr(own)[0]
    assert left == pytest.approx(series - basis @ (basis.T @ series), abs=1e-9)
    assert span.projected_out(series[:, 0]) == pytest.approx(left[:, 0], abs=1e-9)
    # In single precision as well as the rounding of the largest allows.
    single = span.projected_out(series.astype(np.float32))
    assert single.dtype == np.float32
    assert np.abs(single - left).max() < 1e-6 * np.abs(series).max()
    # The columns left out add nothing that shows: a hundredth of a column's norm at most.
    norms = np.linalg.norm(columns, axis=0)
    assert (np.linalg.norm(columns - basis @ (basis.T @ columns), axis=0) <= 0.011 * norms).all()


def test_the_factor_is_a_band_and_the_columns_stay_where_they_are() -> None:
    """A chain of stretches costs as many numbers as its pieces have, not all rows by all columns."""
    pieces = _pieces(17, (40,))
    span = span_of(pieces, ROWS)
    assert span.columns.nnz <= sum(values.size for _, values in pieces)
    assert span.factor.shape == (9, span.columns.shape[1])
    gram = np.asarray((span.columns.T @ span.columns).todense())
    lower = np.zeros_like(gram)
    for below, diagonal in enumerate(span.factor):
        lower += np.diag(diagonal[: len(diagonal) - below], -below)
    assert lower @ lower.T == pytest.approx(gram, abs=1e-12)


def test_the_same_stretch_twice_counts_once() -> None:
    """Nor does a stretch without any torque count."""
    pieces = _pieces(60, (40,))
    twice = [piece for piece in pieces for _ in range(2)]
    empty = [(row, np.zeros_like(values)) for row, values in pieces]
    once = span_of(pieces, ROWS)
    assert span_of(twice, ROWS).columns.shape == once.columns.shape
    none = span_of(empty, ROWS)
    assert none.columns.shape == (ROWS, 0)
    series = np.random.default_rng(2).standard_normal((ROWS, 2))
    assert none.projected_out(series) is series
