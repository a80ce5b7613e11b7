"""Exchange of poses: the set is built up greedily, then poses are replaced while the criterion improves (DETMAX)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from oed.criteria import Criterion
from robots.common.arrays import Array

PASSES = 20
SHORTLIST = 80  # candidates by the determinant whose criterion is computed; of log det itself all count
GAIN = 1e-9  # relative; smaller ones are rounding
RIDGE = 1e-6  # of the largest information, so that fewer poses than parameters have an order


def exchanged(rows: Array, count: int, criterion: Criterion, *, start: list[int] | None = None) -> list[int]:
    """Chooses poses among candidates.

    Mitchell's DETMAX (1974) with excursions of one pose, and Fedorov's (1972) best replacement.

    Args:
        rows: scaled rows of the candidates (C, r, L).
        count: number of poses.
        criterion: a function of the eigenvalues of the information.
        start: a set to start from; the greedy one by default.

    Returns:
        Numbers of the candidates that were chosen; one may occur twice.
    """
    grams = np.swapaxes(rows, 1, 2) @ rows
    size = rows.shape[2]
    ridge = RIDGE * float(np.trace(grams.mean(0))) / size * np.eye(size)
    chosen = list(start or [])
    total = ridge + sum((grams[k] for k in chosen), np.zeros((size, size)))
    while len(chosen) < count:
        # Without enough poses only the determinant says something.
        best = int(np.argmax(_determinant_gain(rows, total)))
        chosen.append(best)
        total = total + grams[best]
    cost = _cost(criterion)
    value = cost(total[None] - ridge)[0]
    for _ in range(PASSES):
        before = value
        for place in range(count):
            without = total - grams[chosen[place]]
            gain = _determinant_gain(rows, without)
            few = np.arange(len(rows)) if criterion.name == "d" else np.argsort(-gain)[:SHORTLIST]
            if criterion.name == "d":
                best = int(np.argmax(gain))
                new = cost((without + grams[best] - ridge)[None])[0]
            else:
                values = cost(without + grams[few] - ridge)
                best, new = int(few[np.argmin(values)]), float(np.min(values))
            if new < value - GAIN * abs(value):
                chosen[place], total, value = best, without + grams[best], new
        if before - value <= GAIN * abs(before):
            break
    return chosen


def _determinant_gain(rows: Array, total: Array) -> Array:
    """Factor of the determinant that each candidate brings (C,): ``det(1 + J inv(M) J')``."""
    inverse = np.linalg.inv(total)
    small = (rows @ inverse) @ np.swapaxes(rows, 1, 2) + np.eye(rows.shape[1])
    return np.asarray(np.linalg.slogdet(small)[1])


def _cost(criterion: Criterion) -> Callable[[Array], Array]:
    def cost(information: Array) -> Array:
        return np.array([criterion.cost(values) for values in np.linalg.eigvalsh(information)])

    return cost
