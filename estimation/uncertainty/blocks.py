"""Standard errors from blocks of time: errors that are correlated within a block, and independent between blocks."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimation.uncertainty.sandwich import at_least
from robots.common.arrays import Array


def block_numbers(rows: int, count: int) -> NDArray[np.intp]:
    """Numbers rows (N,) by consecutive blocks of about equal size, from 0 to ``count - 1``."""
    return np.arange(rows) * count // rows


def clustered_errors(changes: Array) -> Array:
    """Computes the cluster-robust standard errors of values.

    They are sqrt(B / (B - 1) sum of squares of what each of B blocks changes of a value, to first order).

    Args:
        changes: by each block (B, ...).

    Returns:
        Standard errors (...).

    Source: Liang and Zeger 1986.
    """
    blocks = len(changes)
    return np.asarray(np.sqrt(np.sum(changes**2, axis=0) * blocks / max(blocks - 1, 1)))


def correlated_errors(changes: Array) -> Array:
    """Computes cluster-robust standard errors where errors may be correlated for longer than a block.

    Neighbouring blocks are joined as long as that makes the errors larger, down to a quarter of the blocks.

    Args:
        changes: by each block (B, ...), in the order of time.

    Returns:
        Standard errors (...).

    Source: Flyvbjerg and Petersen 1989.
    """
    joined = [np.add.reduceat(changes, np.arange(0, len(changes), size), axis=0) for size in (1, 2, 4)]
    return np.asarray(np.max([clustered_errors(sums) for sums in joined], axis=0))


def widened_by_blocks(covariance: Array, matrix: Array, residual: Array) -> Array:
    """Widens a covariance to that of scores that are independent between blocks of time, but not within them.

    Variances by `clustered_errors` count where they are larger. The white noise of the model alone is too small where
    an effect's formula is inexact or an effect is missing.

    Args:
        covariance: of independent rows with unit variance (p, p).
        matrix: columns (M, p) in the order of time.
        residual: of these rows (M,).

    Returns:
        The covariance (p, p), with the same correlations.
    """
    # The scatter of thirty blocks of equal length over all logs is known to an eighth.
    edges = np.linspace(0, len(matrix), 31).astype(int)
    scores = np.array([residual[a:b] @ matrix[a:b] for a, b in pairwise(edges)])
    return at_least(covariance, clustered_errors(scores @ covariance) ** 2)


def jackknife_errors(values: Array) -> Array:
    """Computes standard errors by the delete-one-block jackknife.

    Args:
        values: estimates (B, ...), each without one of the B blocks.

    Returns:
        Standard errors (...).

    Source: Kuensch 1989.
    """
    return np.asarray(np.sqrt((len(values) - 1) * np.mean((values - values.mean(axis=0)) ** 2, axis=0)))


def moving_block_sums(values: Array, block: int, resamples: int, rng: np.random.Generator) -> Array:
    """Sums rows over resamples of the moving block bootstrap.

    Args:
        values: (N, k) in the order of time.
        block: rows of a block, N at most.
        resamples: R.
        rng: draws the blocks.

    Returns:
        Sums (R, k) over as many blocks as N holds.

    Source: Kuensch 1989.
    """
    rows = len(values)
    sums = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
    starts = rng.integers(0, rows - block + 1, (resamples, max(1, rows // block)))
    return np.asarray((sums[block:] - sums[:-block])[starts].sum(axis=1))


def circular_block_counts(pieces: int, moving: int, resamples: int, rng: np.random.Generator) -> Array:
    """Counts how often each piece occurs in resamples of the circular block bootstrap.

    Args:
        pieces: number of pieces K, in the order of time.
        moving: consecutive pieces of a block; the first follows the last.
        resamples: R.
        rng: draws the blocks.

    Returns:
        Counts (R, K).

    Source: Politis and Romano 1992.
    """
    draws = rng.integers(pieces, size=(resamples, -(-pieces // moving)))
    drawn = (draws[:, :, None] + np.arange(moving)).reshape(resamples, -1) % pieces
    return np.array([np.bincount(chosen, minlength=pieces) for chosen in drawn], dtype=np.float64)
