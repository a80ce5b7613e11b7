"""Time steps of a log, the parts between its gaps, and steps of its clock: the time jumps, and the motion does not."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimation.recordings.rows.columns import Columns
from robots.common.arrays import Array

# Fewer rows than this give no derivatives.
FEWEST = 20
# A step is a gap above this many median steps and above this time [s]: the arm may have changed its motion meanwhile. A
# shorter interruption, as of a network, is interpolated without harm.
GAP_STEPS, GAP_TIME = 8.0, 0.1

# A step of time is compared with the motion from this deviation from the sample period on [s], and from this share of
# the period.
LEAST_STEP, STEP_SHARE = 0.015, 0.25
# Rows on either side that a polynomial of this degree must describe.
SIDE, DEGREE = 8, 4
# The steps of so many rows before and after must have the usual mean, to this share: a late row is none of the clock.
CALM = 0.3
# The logged times must be wrong by this mean square of the usual deviation, ...
WRONG = 12.0
# ... and by so many times more than even times. Even times must be right to this mean square.
BETTER, RIGHT = 5.0, 20.0
# Most steps that are examined, and places from which the usual deviation is estimated.
MOST, PLACES = 1000, 60


@dataclass(frozen=True, eq=False)
class Timing:
    """The clock of a log with N rows.

    Attributes:
        steps: time steps (N - 1,) [s].
        period: median step [s], NaN without steps.
        gaps: indices of the steps that are gaps.
        clock_steps: indices of the steps in which the clock was set.
        parts: (first, stop) rows of the parts between gaps, and between steps of the clock.
    """

    steps: Array
    period: float
    gaps: NDArray[np.intp]
    clock_steps: NDArray[np.intp]
    parts: tuple[tuple[int, int], ...]


def measure_timing(t: Array, set_at: Array | None = None) -> Timing:
    """Measures the time steps and finds the gaps.

    Args:
        t: time (N,) [s].
        set_at: times of the rows before which the clock was set [s].
    """
    steps, none = np.diff(t), np.empty(0, dtype=np.intp)
    if not len(steps):
        return Timing(steps, np.nan, none, none, ((0, len(t)),))
    period = float(np.median(steps))
    gaps = np.flatnonzero((steps > GAP_STEPS * period) & (steps > GAP_TIME))
    stepped = none if set_at is None else np.searchsorted(t, set_at) - 1
    stepped = stepped[(stepped >= 0) & (stepped < len(steps))]
    gaps = np.setdiff1d(gaps, stepped)
    edges = np.concatenate([[0], np.union1d(gaps, stepped) + 1, [len(t)]])
    return Timing(steps, period, gaps, stepped, tuple((int(first), int(stop)) for first, stop in pairwise(edges)))


@dataclass(frozen=True, eq=False)
class ClockSteps:
    """Rows after which the clock was set while the arm moved on.

    Attributes:
        rows: indices of the first rows after a step.
        sizes: by which the clock was set ahead, negative for back [s].
    """

    rows: NDArray[np.intp]
    sizes: Array


def find_clock_steps(t: Array, columns: Columns) -> ClockSteps:
    """Finds steps of time over which the arm moves as far as in one sample period.

    A polynomial of the rows around a step is fitted to the positions of all joints twice: at the logged times, and at
    even times. If rows are missing, the logged times fit. If the clock was set, the even times do.

    Args:
        t: (N,) [s].
        columns: of the log.
    """
    none = ClockSteps(np.empty(0, dtype=np.intp), np.empty(0))
    steps = np.diff(t)
    if len(t) < max(4 * SIDE, FEWEST):
        return none
    period = float(np.median(steps))
    candidates = np.flatnonzero(np.abs(steps - period) > max(LEAST_STEP, STEP_SHARE * period))
    # The log is cut at longer steps in any case, and the motion during them is not known.
    candidates = candidates[steps[candidates] <= 2 * max(GAP_STEPS * period, GAP_TIME)]
    candidates = candidates[(candidates >= SIDE - 1) & (candidates < len(t) - SIDE)]
    candidates = candidates[_between_calm(steps, candidates, period)]
    if not len(candidates):
        return none
    candidates = candidates[:: 1 + len(candidates) // MOST]
    usual = _usual_deviations(t, columns, period)
    moves = usual > 0
    if not moves.any():
        return none
    q, usual = columns.q[moves], usual[moves]
    rows = [int(k) for k in candidates if _is_clock_step(t, q, usual, int(k), period)]
    return ClockSteps(np.array(rows, dtype=np.intp) + 1, steps[rows] - period) if rows else none


def _between_calm(steps: Array, rows: NDArray[np.intp], period: float) -> NDArray[np.bool_]:
    """Whether the steps around these rows have the usual mean."""
    reach = np.arange(1, SIDE)
    before = steps[np.maximum(rows[:, None] - reach, 0)].mean(axis=1)
    after = steps[np.minimum(rows[:, None] + reach, len(steps) - 1)].mean(axis=1)
    return np.asarray((np.abs(before - period) < CALM * period) & (np.abs(after - period) < CALM * period))


def _usual_deviations(t: Array, columns: Columns, period: float) -> Array:
    """Gives the mean square deviation of each joint (n,) from the polynomial, at even places of the log."""
    places = np.unique(np.linspace(SIDE - 1, len(t) - SIDE - 1, PLACES).astype(int))
    found = []
    for k in places:
        rows = slice(k - SIDE + 1, k + SIDE + 1)
        if np.abs(np.diff(t[rows]) - period).max() < CALM * period:
            found.append(_deviations(t[rows], columns.q[:, rows]))
    if not found:
        return np.zeros(len(columns.q))
    rounding = columns.position_steps**2 / 12
    usual = np.maximum(np.quantile(found, 0.75, axis=0), rounding + (1e-9 * columns.travel) ** 2)
    return np.asarray(np.where(columns.travel > 0, usual, 0.0))


def _is_clock_step(t: Array, q: Array, usual: Array, k: int, period: float) -> bool:
    rows = slice(k - SIDE + 1, k + SIDE + 1)
    logged = np.array(t[rows])
    even = np.array(logged)
    even[SIDE:] += period - (t[k + 1] - t[k])
    wrong, right = (float(np.mean(_deviations(times, q[:, rows]) / usual)) for times in (logged, even))
    return wrong > WRONG and right < RIGHT and wrong > BETTER * right


def _deviations(t: Array, q: Array) -> Array:
    """Gives the mean square deviation of each joint (n,) from a polynomial of time."""
    x = t - t.mean()
    basis, _ = np.linalg.qr(np.vander(x / max(float(np.abs(x).max()), 1e-300), DEGREE + 1))
    rest = q.T - basis @ (basis.T @ q.T)
    return np.asarray(np.einsum("tj,tj->j", rest, rest) / (len(t) - DEGREE - 1))
