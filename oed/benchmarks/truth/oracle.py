"""Largest possible gain of a case: that of its true effects, with their own formulas, on its held-out logs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import attrgetter

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.signal import butter, sosfiltfilt

from oed.benchmarks.truth.cases import MOTION, PROJECTION_STRIDE, Case
from oed.benchmarks.truth.dynamics import Projection, base_regressor
from oed.benchmarks.truth.plant import Record, measure
from oed.benchmarks.truth.ride import Ride

CUT_OFFS = (10.0, 20.0, 40.0, 80.0)  # [Hz]
REVERSAL_ROWS = 5  # rows on each side of a reversal that do not count


@dataclass(frozen=True, kw_only=True)
class Oracle:
    """Mean squared errors (n,) [(N m)^2] on a case's held-out logs, after least squares on the logs to diagnose.

    ``before`` is that of the base model, evaluated on the true motion. ``after`` has the torque of each true effect on
    that motion as an additional column. ``as_measured`` has the effects' torque on the motion from logged positions
    instead, which is all that a model can use. These positions are low-passed without lag, at the cut-off that fits
    the logs best. It is None if it was not asked for.
    """

    before: np.ndarray
    after: np.ndarray
    as_measured: np.ndarray | None = None


def ask_oracle(case: Case, counted: Sequence[np.ndarray] | None = None, *, logged: bool = False) -> Oracle:
    """Measures the gain of a case's true effects with their own formulas.

    Args:
        case: a case with held-out logs.
        counted: rows (N, n) of each held-out log that count. By default all rows except those next to a joint's
            reversal, because a log does not show the sign of friction there.
        logged: whether to evaluate the effects on the logged positions, too, which takes most of the time.

    Returns:
        The mean squared errors.
    """
    chosen = counted or [_away_from_reversals(record.v_true) for record in case.unseen]
    counts = np.concatenate([rows[::PROJECTION_STRIDE] for rows in chosen])
    level = case.level()

    def rows(of: Callable[[Record], np.ndarray]) -> np.ndarray:
        return np.concatenate([of(record)[::PROJECTION_STRIDE] for record in case.records])

    Y = base_regressor(case.machine.known, *(rows(attrgetter(key)) for key in MOTION))
    y = rows(attrgetter("tau"))
    training, others = slice(len(y) - len(counts)), slice(len(y) - len(counts), None)

    def errors(columns: np.ndarray) -> tuple[float, np.ndarray]:
        """Computes the weighted sum of squares on the logs, and the mean squares (n,) on the held-out logs."""
        squares = (y - columns @ Projection(columns[training], level).fit(y[training])) ** 2
        unseen = (squares[others] * counts).sum(axis=0) / counts.sum(axis=0)
        return float((squares[training] / level**2).sum()), unseen

    def beside(parts: np.ndarray) -> tuple[float, np.ndarray]:
        return errors(np.concatenate([Y, parts], axis=2))

    true = [
        np.concatenate([record.parts[k][::PROJECTION_STRIDE] for record in case.records])
        for k in range(len(case.effects))
    ]
    tried = [beside(_parts_as_measured(case, cut_off)) for cut_off in CUT_OFFS] if logged else []
    return Oracle(
        before=errors(Y)[1],
        after=beside(np.stack(true, axis=2))[1],
        as_measured=min(tried, key=lambda pair: pair[0])[1] if tried else None,
    )


def _away_from_reversals(v: np.ndarray) -> np.ndarray:
    """Flags rows (N, n) more than `REVERSAL_ROWS` samples from a reversal."""
    turned = np.zeros(v.shape, dtype=bool)
    turned[1:] = np.sign(v[1:]) != np.sign(v[:-1])
    counted = np.cumsum(np.vstack([np.zeros((1, v.shape[1])), turned]), axis=0)
    rows = np.arange(len(v))
    return counted[np.minimum(rows + REVERSAL_ROWS + 1, len(v))] == counted[np.maximum(rows - REVERSAL_ROWS, 0)]


def _parts_as_measured(case: Case, cut_off: float) -> np.ndarray:
    """Computes the torque of each effect (N, n, effects) on the motion from the logged positions."""
    times, motions, starts, count = [], [], [], 0
    # Sample period [s] of the motion from logged positions.
    step = 0.002
    for record in case.records:
        period = float(record.t[1] - record.t[0])
        smooth = sosfiltfilt(butter(4, 2 * period * cut_off, output="sos"), record.q, axis=0)
        spline = make_interp_spline(record.t, smooth, k=5)
        t = record.t[0] + np.arange(round(len(record.t) * period / step)) * step
        motions.append([spline(np.minimum(t, record.t[-1]), nu) for nu in range(3)])
        times.append(t)
        starts.append(count)
        count += len(t)
    t = np.concatenate(times)
    seen = [np.concatenate(values) for values in zip(*motions, strict=True)]
    motion = list(seen)
    # Fixed-point iterations for effects on the motion itself.
    for _ in range(3):
        # An effect on the logged positions depends on the true motion, which a fixed-point iteration finds.
        ride = Ride(machine=case.machine, t=t, starts=tuple(starts), q=motion[0], v=motion[1], a=motion[2])
        _, wrong = measure(ride, case.effects)
        logged = [own + error for own, error in zip((ride.q, ride.v, ride.a), wrong, strict=True)]
        off = [s - value for s, value in zip(seen, logged, strict=True)]
        if np.abs(off[0]).max() == 0.0:
            break
        motion = [values + more for values, more in zip(motion, off, strict=True)]
    index = np.concatenate([np.searchsorted(t, r.t[::PROJECTION_STRIDE] - step / 2) for r in case.records])
    return np.stack([part[np.minimum(index, len(t) - 1)] for part in ride.parts], axis=2)
