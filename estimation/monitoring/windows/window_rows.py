"""Rows of one window: smoothed, differentiated, averaged over short blocks, with the model's torques."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from estimation.monitoring.windows.baseline import Baseline, Directions
from estimation.predictions.checked_motions import smoother_of
from estimation.preprocessing import resample, smooth
from robots.common.arrays import Array
from robots.common.errors import InputError


def settling(cutoff: float) -> float:
    """Time [s] at the edge of rows in which their smoothing has too little to rest on."""
    return max(0.1, 1.0 / cutoff)


@dataclass(frozen=True, kw_only=True, eq=False)
class WindowRows:
    """A window in blocks.

    Attributes:
        t: times (N,) [s].
        dq: velocities (N, n).
        tau: torques (N, n) [N m or N].
        directions: the model's torques.
        temperatures: means (n,) [degC], NaN where unknown.
        ambient: mean [degC], or None.
    """

    t: Array
    dq: Array
    tau: Array
    directions: Directions
    temperatures: Array
    ambient: float | None


def rows_of_window(
    baseline: Baseline,
    rows: Array,
    start: float,
    end: float,
    *,
    last: bool,
    payload: Array | None,
    gravity: ArrayLike | None,
) -> WindowRows | None:
    """Prepares a window; None where its rows are too few to be smoothed.

    Args:
        baseline: the model.
        rows: time, positions, torques, temperatures, ambient, with margins (N, 2 + 3 n).
        start: of the window [s].
        end: of the window [s].
        last: whether nothing follows, so that the smoothing has no margin there.
        payload: that the recording states, or None.
        gravity: that the recording states, or None.
    """
    n = baseline.robot.n
    t, q, tau = rows[:, 0], rows[:, 1 : 1 + n], rows[:, 1 + n : 1 + 2 * n]
    try:
        motion = smooth(resample(t, q), smoother_of(baseline.model, baseline.cutoff))
    except InputError:
        return None
    edge = settling(baseline.cutoff)
    low = start if t[0] < start else max(start, float(t[0]) + edge)
    high = min(end, float(t[-1]) - edge) if last else end
    inside = (t >= low) & (t < high)
    period = float(np.median(np.diff(t)))
    # Blocks per period of the smoothing's cut-off: slow enough to be cheap, fast enough for what the motion holds.
    size = max(1, int(1.0 / (5.0 * baseline.cutoff * period)))
    count = int(inside.sum()) // size
    if count < 20:
        return None
    first = int(np.argmax(inside))
    chosen = slice(first, first + count * size)

    def averaged(values: Array) -> Array:
        return np.asarray(values[chosen].reshape(count, size, *values.shape[1:]).mean(axis=1))

    times, positions, velocities = averaged(t), averaged(motion.q), averaged(motion.dq)
    accelerations, torques = averaged(motion.ddq), averaged(tau)
    return WindowRows(
        t=times,
        dq=velocities,
        tau=torques,
        directions=baseline.directions(times, positions, velocities, accelerations, gravity=gravity, payload=payload),
        temperatures=_means(rows[chosen, 1 + 2 * n : 1 + 3 * n]),
        ambient=_mean(rows[chosen, -1]),
    )


def _means(values: Array) -> Array:
    known = np.isfinite(values)
    count = known.sum(axis=0)
    total = np.where(known, values, 0.0).sum(axis=0)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _mean(values: Array) -> float | None:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else None
