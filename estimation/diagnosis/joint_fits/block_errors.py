"""Standard errors by blocks of time: what the formulas leave in the residual lasts longer than the noise."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimation.uncertainty.sandwich import at_least

Array = NDArray[np.float64]

BLOCKS = 30
"""Blocks of equal length over all logs; their own scatter is known to an eighth."""


def widened_by_blocks(covariance: Array, matrix: Array, residual: Array) -> Array:
    """Widens a covariance to that of scores that are independent between blocks of time, but not within them.

    It is the cluster-robust covariance (Liang and Zeger 1986), whose variances count where they are larger. The white
    noise of the model alone is too small where an effect's formula is inexact or an effect is missing.

    Args:
        covariance: of independent rows with unit variance (p, p).
        matrix: columns (M, p) in the order of time.
        residual: of these rows (M,).

    Returns:
        The covariance (p, p), with the same correlations.
    """
    edges = np.linspace(0, len(matrix), BLOCKS + 1).astype(int)
    scores = np.array([residual[a:b] @ matrix[a:b] for a, b in pairwise(edges)])
    changes = scores @ covariance  # of the values, by each block
    return at_least(covariance, np.sum(changes**2, axis=0) * BLOCKS / (BLOCKS - 1))
