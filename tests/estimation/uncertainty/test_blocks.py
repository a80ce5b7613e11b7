"""Tests of standard errors by blocks of time, against the scatter of many fits."""

from __future__ import annotations

import numpy as np

from estimation.uncertainty.blocks import (
    block_numbers,
    circular_block_counts,
    clustered_errors,
    jackknife_errors,
    moving_block_sums,
    widened_by_blocks,
)

ROWS, FITS = 3000, 300


def _fits(misfit: float, seed: int) -> tuple[float, float, float]:
    """Fits three columns many times; the residual has white noise and a part that lasts for 30 rows.

    Returns:
        Scatter of the first value over the fits, and its mean standard errors without and with blocks.
    """
    rng = np.random.default_rng(seed)
    matrix = np.repeat(rng.normal(size=(ROWS // 30, 3)), 30, axis=0) + 0.2 * rng.normal(size=(ROWS, 3))
    covariance = np.linalg.inv(matrix.T @ matrix)
    values, wider = [], []
    for _ in range(FITS):
        lasting = np.repeat(rng.normal(size=ROWS // 30), 30)
        data = rng.normal(size=ROWS) + misfit * lasting
        found = covariance @ (matrix.T @ data)
        values.append(found[0])
        wider.append(widened_by_blocks(covariance, matrix, data - matrix @ found)[0, 0])
    return float(np.std(values)), float(np.sqrt(covariance[0, 0])), float(np.sqrt(np.mean(wider)))


def test_a_misfit_that_lasts_widens_the_errors_to_the_scatter() -> None:
    """A lasting part as large as the noise makes errors five times as large, and the blocks show it to 15 %."""
    scatter, white, blocks = _fits(1.0, 1)
    assert scatter > 4.0 * white
    assert abs(blocks / scatter - 1.0) < 0.15


def test_white_noise_hardly_widens_them() -> None:
    """The errors of white noise are never narrowed, and wider by a tenth only, by chance of the blocks' own scatter."""
    scatter, white, blocks = _fits(0.0, 2)
    assert abs(scatter / white - 1.0) < 0.15
    assert white <= blocks < 1.15 * white


def test_correlations_stay_and_nothing_is_no_error() -> None:
    """A column that is zero has no variance, and two values keep their correlation."""
    rng = np.random.default_rng(3)
    matrix = np.column_stack([rng.normal(size=(ROWS, 2)) @ np.array([[1.0, 0.6], [0.0, 0.8]]), np.zeros(ROWS)])
    covariance = np.zeros((3, 3))
    covariance[:2, :2] = np.linalg.inv(matrix[:, :2].T @ matrix[:, :2])
    wider = widened_by_blocks(covariance, matrix, np.repeat(rng.normal(size=ROWS // 30), 30))
    assert np.isfinite(wider).all()
    assert not wider[2].any()
    before, after = (c[0, 1] / np.sqrt(c[0, 0] * c[1, 1]) for c in (covariance, wider))
    np.testing.assert_allclose(after, before, rtol=1e-12)


def test_the_jackknife_of_a_mean_is_its_standard_error() -> None:
    """Of a mean over B blocks it is the blocks' standard deviation over sqrt(B), and so is the clustered error."""
    blocks = np.random.default_rng(4).normal(size=(20, 3))
    without = np.array([np.delete(blocks, k, axis=0).mean(axis=0) for k in range(20)])
    expected = blocks.std(axis=0, ddof=1) / np.sqrt(20)
    np.testing.assert_allclose(jackknife_errors(without), expected, rtol=1e-12)
    np.testing.assert_allclose(clustered_errors((blocks - blocks.mean(axis=0)) / 20), expected, rtol=1e-12)


def test_blocks_are_consecutive_and_of_equal_size() -> None:
    """Each of 7 blocks of 50 rows has 7 or 8 of them."""
    numbers = block_numbers(50, 7)
    assert (np.diff(numbers) >= 0).all()
    assert set(np.bincount(numbers)) == {7, 8}


def test_moving_blocks_scatter_as_a_mean_of_correlated_rows_does() -> None:
    """Sums over rows that are equal in groups of 10 scatter as those of the groups, and single rows would not."""
    rng = np.random.default_rng(5)
    rows = np.repeat(rng.normal(size=400), 10)[:, None]
    sums = moving_block_sums(rows, 100, 2000, rng)
    # The 400 groups know the scatter to 3.5 %, blocks of ten groups to a tenth.
    assert abs(sums.std() / (10 * np.sqrt(400)) - 1) < 0.15
    assert sums.shape == (2000, 1)


def test_circular_blocks_hold_consecutive_pieces() -> None:
    """Each resample has as many pieces as the data, of whole blocks that may pass the end."""
    counts = circular_block_counts(12, 4, 50, np.random.default_rng(6))
    assert (counts.sum(axis=1) == 12).all()
    # 12 pieces in blocks of 4: a resample of three blocks touches at most three runs of pieces.
    assert (((counts > 0) & (np.roll(counts, 1, axis=1) == 0)).sum(axis=1) <= 3).all()
