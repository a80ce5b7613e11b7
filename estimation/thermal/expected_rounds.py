"""How far an iteration is that ends once its change is small, for a progress bar with an honest remaining time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def expected_rounds(changes: Sequence[float], settled: float, most: int) -> float:
    """Estimates how many rounds an iteration takes that converges linearly.

    The logarithm of the change falls by the same amount each round, so two rounds show how many are left.

    Args:
        changes: relative change of each round so far; at least one.
        settled: the change at which it ends.
        most: rounds after which it ends in any case.

    Returns:
        The rounds in all, at least those done; `most` where the changes do not fall.
    """
    done = len(changes)
    if changes[-1] < settled:
        return float(done)
    if done < 2 or not 0.0 < changes[-1] < changes[-2]:
        return float(most)
    left = np.log(changes[-1] / settled) / np.log(changes[-2] / changes[-1])
    return float(min(most, done + max(1.0, np.ceil(left))))
