"""Wrapped angles: positions that jump by a turn while the joint moves on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robots.common.arrays import Array

Rows = NDArray[np.intp]

# Turns in the units that positions come in: degrees that were taken for radians, and radians.
TURNS = (360.0, 2.0 * np.pi)
# A wrap leaves the motion continuous: without the turn, the step differs from the steps around it by less than this
# share of a turn, or by so many usual differences between neighbouring steps.
SMOOTH, USUAL = 0.02, 8.0
# Steps on either side from which the motion's own step is taken, and the longest step in time over the median one: the
# motion during a longer one is not known.
AROUND, LONGEST = 3, 3.5
# Turns up to this number are counted at once.
MOST = 2
# A row between the ends of a turn is looked for only if 90 % of the steps are below this share of a turn.
SLOW = 1.0 / 8.0


@dataclass(frozen=True, eq=False)
class Wraps:
    """The wraps of one joint.

    Attributes:
        joint: counted from 0.
        turn: in the unit of the position.
        rows: the first row after each wrap, counted from 0.
        q: the position without them (N,).
    """

    joint: int
    turn: float
    rows: Rows
    q: Array


def find_wraps(joint: int, q: Array, t: Array) -> Wraps | None:
    """Finds the wraps of an angle, at any speed below half a turn a row.

    A single outlier leaves the motion and returns, and does so by any amount. A wrap is a turn, and the motion goes on.
    A logger that interpolates may write one row between the two ends of the turn.

    Args:
        joint: counted from 0.
        q: position of the joint (N,).
        t: time (N,) [s].

    Returns:
        None without wraps.
    """
    if len(q) < 2 * AROUND + 2:
        return None
    for turn in TURNS:
        # An angle that wraps stays inside one turn: a large step of a wider one is a step in another unit.
        found = _find(joint, q, t, turn) if np.ptp(q) < (1 + SMOOTH) * turn else None
        if found is not None:
            return found
    return None


def _find(joint: int, q: Array, t: Array, turn: float) -> Wraps | None:
    steps = np.diff(q)
    large = np.abs(steps) > turn / 2
    two = q[2:] - q[:-2]
    crossed = (np.abs(two) > turn / 2) & (steps[1:] * two > 0) & (steps[:-1] * two > 0)
    crossed &= bool(np.quantile(np.abs(steps), 0.9) < SLOW * turn)
    if not large.any() and not crossed.any():
        return None
    periods = np.diff(t)
    periods = periods / np.median(periods)
    odd = large.copy()
    odd[:-1] |= crossed
    odd[1:] |= crossed
    plain = np.flatnonzero(~odd & (periods < LONGEST))
    if len(plain) < 2 * AROUND:
        return None
    rate = steps[plain] / periods[plain]
    usual = float(np.quantile(np.abs(np.diff(rate)), 0.95))
    tolerance = max(SMOOTH * turn, min(USUAL * usual, turn / 8))

    def expected(row: int) -> float:
        at = int(np.searchsorted(plain, row))
        return float(np.median(rate[max(at - AROUND, 0) : at + AROUND]))

    turns = np.zeros(len(q))
    rows: list[int] = []
    filled: list[int] = []
    for row in np.flatnonzero(odd).tolist():
        if rows and row < rows[-1]:
            continue
        for length in (1, 2):
            stop = row + length
            if stop > len(steps) or (length == 2 and not crossed[row]):
                continue
            span = float(periods[row:stop].sum())
            step = float(q[stop] - q[row])
            count = round((step - expected(row) * span) / turn)
            rest = step - count * turn - expected(row) * span
            if 0 < abs(count) <= MOST and abs(rest) < tolerance * span and span < LONGEST * length:
                turns[stop] -= count * turn
                rows.append(stop)
                if length == 2:
                    filled.append(row + 1)
                break
    if not rows or _return_at_once(rows, turns):
        return None
    smooth = q + np.cumsum(turns)
    for row in filled:
        share = (t[row] - t[row - 1]) / (t[row + 1] - t[row - 1])
        smooth[row] = smooth[row - 1] + share * (smooth[row + 1] - smooth[row - 1])
    return Wraps(joint, turn, np.array(rows, dtype=np.intp), smooth)


def _return_at_once(rows: list[int], turns: Array) -> bool:
    """Whether all turns are taken back in the next row: outliers that happen to be as large as a turn."""
    pairs = zip(rows[::2], rows[1::2], strict=False)
    return len(rows) % 2 == 0 and all(b == a + 1 and turns[a] == -turns[b] for a, b in pairs)
