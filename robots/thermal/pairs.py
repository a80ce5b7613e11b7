"""The exponential of two coupled heat balances in closed form, which is what makes long simulations fast."""

from __future__ import annotations

import numpy as np

from robots.common.arrays import Array


class PairExponential:
    """Two states whose exchange goes both ways: the eigenvalues of A are real, negative and differ."""

    @classmethod
    def exponentials(cls, A: Array, h: Array) -> tuple[Array, Array]:
        """Gives exp(A h) and its integral over h, (M, 2, 2) each, of M systems over M times [s]."""
        mean = (A[:, 0, 0] + A[:, 1, 1]) / 2.0
        half = (A[:, 0, 0] - A[:, 1, 1]) / 2.0
        spread = np.sqrt(half**2 + A[:, 0, 1] * A[:, 1, 0])
        identity = np.eye(2)
        shifted = A - mean[:, None, None] * identity
        # The product of the eigenvalues is the determinant: their difference from the mean would lose digits.
        fast_rate = mean - spread
        slow_rate = (A[:, 0, 0] * A[:, 1, 1] - A[:, 0, 1] * A[:, 1, 0]) / fast_rate
        parts = []
        for slow, fast in (
            (np.exp(slow_rate * h), np.exp(fast_rate * h)),
            (np.expm1(slow_rate * h) / slow_rate, np.expm1(fast_rate * h) / fast_rate),
        ):
            even, odd = (slow + fast) / 2.0, (slow - fast) / (2.0 * spread)
            parts.append(even[:, None, None] * identity + odd[:, None, None] * shifted)
        return parts[0], parts[1]
