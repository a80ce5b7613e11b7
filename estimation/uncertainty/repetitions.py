"""Logs that repeat a motion: what a model misses repeats with the motion, and counts once and not once a repetition."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from estimation.uncertainty.correlations import squared_differences
from estimation.uncertainty.sandwich import Part, at_least, covariance
from robots.common.arrays import Array

# Fewer rows a repetition do not show a noise's colour.
FEWEST_REPEATED_ROWS = 100


@dataclass(frozen=True, eq=False)
class Played:
    """The motion behind the rows of a log.

    Attributes:
        t: times (N,) [s].
        q: positions (N, n) [rad or m].
        period: with which it repeats itself [s]; None where it does not.
        gravity: (3,) in the base frame [m/s2]; None as the robot's description says. The same motion under another
            gravity has another regressor, and does not repeat this one.
        carries: nor with another load.
    """

    t: Array
    q: Array
    period: float | None
    gravity: Array | None = None
    carries: bool = False

    def is_like(self, other: Played) -> bool:
        """Whether equal positions of both have equal regressors, row by row."""
        if self.step is None or other.step is None or self.q.shape[1] != other.q.shape[1]:
            return False
        same_clock = abs(self.step / other.step - 1) * min(len(self.t), len(other.t)) < 1
        if not same_clock or self.carries != other.carries or (self.gravity is None) != (other.gravity is None):
            return False
        return self.gravity is None or other.gravity is None or np.array_equal(self.gravity, other.gravity)

    @property
    def step(self) -> float | None:
        """Period of the rows [s]; None where they are on no uniform grid."""
        steps = np.diff(self.t)
        step = float(np.median(steps)) if len(steps) else 0.0
        # Steps of time that differ by more than this share make no uniform grid.
        return step if step > 0 and float(np.ptp(steps)) <= 0.5 * step else None


class Place(NamedTuple):
    """Where a repetition begins: the number of its log, and its first row, which may lie before the log's first."""

    log: int
    row: int


def repetitions(logs: Sequence[Played]) -> list[tuple[int, list[Place]]]:
    """Groups the logs by their motions, and finds where each repetition of a motion begins.

    Args:
        logs: in any order.

    Returns:
        Of each motion the rows of one repetition, and where it begins. A log that neither repeats itself nor another
        has one place.
    """
    found: list[tuple[int, list[Place]]] = []
    leaders: list[int] = []
    for log in sorted(range(len(logs)), key=lambda i: -len(logs[i].t)):
        for number, leader in enumerate(leaders):
            shift = _shift(logs[leader], logs[log])
            if shift is not None:
                rows, places = found[number]
                found[number] = (rows, [*places, *_places(logs[leader], logs[log], log, -shift, rows)])
                break
        else:
            leaders.append(log)
            rows = _rows(logs[log])
            found.append((rows, _places(logs[log], logs[log], log, 0, rows)))
    return found


def _rows(log: Played) -> int:
    """Rows of one period, or of the log."""
    whole = len(log.t)
    if log.period is None or log.step is None:
        return whole
    rows = round(log.period / log.step)
    # Smoothing takes the ends of a log of two periods.
    return rows if rows >= FEWEST_REPEATED_ROWS and whole >= 1.5 * rows else whole


def _places(leader: Played, log: Played, number: int, first: int, rows: int) -> list[Place]:
    """Repetitions within a log: one begins at a given row, which may lie outside."""
    if rows == len(leader.t) or leader.period is None or leader.step is None:
        return [Place(number, first)]
    exact = leader.period / leader.step
    numbers = np.arange(np.floor(-first / exact), np.ceil((len(log.t) - first) / exact))
    begins = np.round(first + numbers * exact).astype(int).tolist()
    return [Place(number, begin) for begin in begins if begin > -rows and begin < len(log.t)]


def _shift(one: Played, other: Played) -> int | None:
    """The rows by which the motion of another log comes before that of the first; None if it is not the same."""
    # Logs of one motion have half of the shorter log in common.
    least = max(FEWEST_REPEATED_ROWS, int(0.5 * min(len(one.q), len(other.q))))
    if not one.is_like(other) or min(len(one.q), len(other.q)) < least:
        return None
    spread = one.q.std(axis=0)
    scale = np.where(spread > 1e-6 * max(1.0, float(spread.max())), spread, max(float(spread.max()), 1e-12))
    a, b = (one.q - one.q.mean(axis=0)) / scale, (other.q - one.q.mean(axis=0)) / scale
    shifts = np.arange(least - len(b), len(a) - least + 1)
    shift = int(shifts[squared_differences(a, b, shifts).sum(axis=1).argmin()])
    begin, end = max(shift, 0), min(len(a), len(b) + shift)
    miss = np.sqrt(np.mean((a[begin:end] - b[begin - shift : end - shift]) ** 2, axis=0))
    # Two logs play one motion if their positions differ by less than 5 % of each joint's standard deviation. Half a
    # sample of delay makes 2 % in a fast motion.
    return shift if float(miss.max()) < 0.05 else None


def folded(parts: Sequence[Part], rows: int, places: Sequence[Place]) -> Part:
    """Averages the rows of equal phase over the repetitions of a motion.

    The score Y'We of a fit is, phase by phase, the number of repetitions times the mean row times the mean residual.
    Noise averages out in that mean; what the model misses does not. A covariance of the mean residual therefore holds
    both.

    Args:
        parts: the logs' rows.
        rows: of one repetition.
        places: where the repetitions begin.

    Returns:
        One repetition, which counts as often as the motion repeats; the log itself where it plays once.
    """
    if len(places) == 1:
        return parts[places[0].log]
    first = parts[places[0].log]
    ends = [min(place.row + rows, parts[place.log].rows) for place in places]
    counts, errors = np.zeros((rows, first.mask.shape[1])), np.zeros((rows, first.mask.shape[1]))
    for place, end in zip(places, ends, strict=True):
        part, begin = parts[place.log], max(place.row, 0)
        counts[begin - place.row : end - place.row] += part.mask[begin:end]
        errors[begin - place.row : end - place.row] += part.residual[begin:end]

    def mean(evaluate: Callable[[Part, int, int], Sequence[Array]], start: int, stop: int) -> list[Array]:
        totals: list[Array] = []
        seen = np.zeros(stop - start)
        for place, end in zip(places, ends, strict=True):
            begin, last = max(place.row + start, 0), min(place.row + stop, end)
            if begin >= last:
                continue
            at = slice(begin - place.row - start, last - place.row - start)
            pieces = evaluate(parts[place.log], begin, last)
            totals = totals or [np.zeros((stop - start, *piece.shape[1:])) for piece in pieces]
            for total, piece in zip(totals, pieces, strict=True):
                total[at] += piece
            seen[at] += 1
        return [total / np.maximum(seen, 1).reshape(-1, *[1] * (total.ndim - 1)) for total in totals]

    def regressor(start: int, stop: int) -> Array:
        (found,) = mean(lambda part, begin, last: [part.regressor(begin, last)], start, stop)
        return found

    def split(start: int, stop: int) -> list[Array]:
        return mean(lambda part, begin, last: part.split(begin, last) if part.split else [], start, stop)

    return Part(
        rows=rows,
        regressor=regressor,
        mask=counts / len(places),
        residual=errors / np.where(counts > 0, counts, 1.0),
        used=first.used,
        split=None if first.split is None else split,
        repeats=len(places),
    )


def with_repetitions(
    plain: Array,
    parts: Sequence[Part],
    played: Sequence[Played],
    weights: Array,
    inverse: Array,
    seed: int = 0,
    averaged: int = 1,
) -> Array:
    """Raises the covariance of weighted least squares where logs repeat a motion.

    Each parameter's standard error is at least that of the averaged repetitions.

    Args:
        plain: covariance as if the rows were of different motions (p, p).
        parts: the whole logs.
        played: their motions.
        weights: of the joints' rows (n,).
        inverse: of the weighted Gram matrix (p, p).
        seed: of the drawn noise.
        averaged: see `covariance`.
    """
    found = repetitions(played)
    if all(len(places) == 1 for _, places in found):
        return plain
    repeating = covariance([folded(parts, *motion) for motion in found], weights, inverse, seed, averaged=averaged)
    return at_least(plain, np.diag(repeating))
