"""The gain that a case's true effects would bring on its unseen logs, their own formulas being known."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.signal import butter, sosfiltfilt

from tests.truth.cases import EVERY, MOTION, Case
from tests.truth.dynamics import Projection, base_regressor
from tests.truth.plant import Record, measure
from tests.truth.ride import Ride

STEP = 0.002
CUT_OFFS = (10.0, 20.0, 40.0, 80.0)
ORDER = 4
APPROACHES = 3
BESIDE = 5


@dataclass(frozen=True, kw_only=True)
class Oracle:
    """Mean squared errors (n,) on a case's unseen logs, of least squares on its logs.

    The base model's columns are those of the motion as it was. ``after`` has each effect's own torque along that motion
    as one column more; ``as_measured`` along the motion that the logged positions tell, which is all that any model of
    the effect could be given: low-passed without lag, at the cut-off that fits the logs best. None where not asked for.
    """

    before: np.ndarray
    after: np.ndarray
    as_measured: np.ndarray | None = None


def ask_oracle(case: Case, counted: Sequence[np.ndarray] | None = None, *, logged: bool = False) -> Oracle:
    """Measures what a case's true effects bring, their own formulas being known.

    Args:
        case: with unseen logs.
        counted: rows (N, n) of each unseen log that count; by default all but those beside a joint's reversal: from
            a log nobody knows which sign its friction has there.
        logged: whether to ask along the logged positions, too: that is most of the work.
    """
    chosen = counted or [_away_from_reversals(record.v_true) for record in case.unseen]
    counts = np.concatenate([rows[::EVERY] for rows in chosen])
    level = case.level()

    def rows(of: Callable[[Record], np.ndarray]) -> np.ndarray:
        return np.concatenate([of(record)[::EVERY] for record in case.records])

    Y = base_regressor(case.machine.known, *(rows(lambda record, key=key: getattr(record, key)) for key in MOTION))
    y = rows(lambda record: record.tau)
    training, others = slice(len(y) - len(counts)), slice(len(y) - len(counts), None)

    def errors(columns: np.ndarray) -> tuple[float, np.ndarray]:
        """The weighted sum of squares on the logs, and the mean squares (n,) on the unseen ones."""
        squares = (y - columns @ Projection(columns[training], level).fit(y[training])) ** 2
        unseen = (squares[others] * counts).sum(axis=0) / counts.sum(axis=0)
        return float((squares[training] / level**2).sum()), unseen

    def beside(parts: np.ndarray) -> tuple[float, np.ndarray]:
        return errors(np.concatenate([Y, parts], axis=2))

    true = [rows(lambda record, k=k: record.parts[k]) for k in range(len(case.effects))]
    tried = [beside(_parts_as_measured(case, cut_off)) for cut_off in CUT_OFFS] if logged else []
    return Oracle(
        before=errors(Y)[1],
        after=beside(np.stack(true, axis=2))[1],
        as_measured=min(tried, key=lambda pair: pair[0])[1] if tried else None,
    )


def _away_from_reversals(v: np.ndarray) -> np.ndarray:
    """Marks rows (N, n) more than `BESIDE` samples from a change of direction."""
    turned = np.zeros(v.shape, dtype=bool)
    turned[1:] = np.sign(v[1:]) != np.sign(v[:-1])
    counted = np.cumsum(np.vstack([np.zeros((1, v.shape[1])), turned]), axis=0)
    rows = np.arange(len(v))
    return counted[np.minimum(rows + BESIDE + 1, len(v))] == counted[np.maximum(rows - BESIDE, 0)]


def _parts_as_measured(case: Case, cut_off: float) -> np.ndarray:
    """What each effect adds (N, n, effects) along the motion that the logged positions tell."""
    times, motions, starts, count = [], [], [], 0
    for record in case.records:
        period = float(record.t[1] - record.t[0])
        smooth = sosfiltfilt(butter(ORDER, 2 * period * cut_off, output="sos"), record.q, axis=0)
        spline = make_interp_spline(record.t, smooth, k=5)
        t = record.t[0] + np.arange(round(len(record.t) * period / STEP)) * STEP
        motions.append([spline(np.minimum(t, record.t[-1]), nu) for nu in range(3)])
        times.append(t)
        starts.append(count)
        count += len(t)
    t = np.concatenate(times)
    seen = [np.concatenate(values) for values in zip(*motions, strict=True)]
    motion = list(seen)
    for _ in range(APPROACHES):
        # An effect that parts what is logged from what moves does so from what moves: found by going back and forth.
        ride = Ride(machine=case.machine, t=t, starts=tuple(starts), q=motion[0], v=motion[1], a=motion[2])
        _, wrong = measure(ride, case.effects)
        logged = [own + error for own, error in zip((ride.q, ride.v, ride.a), wrong, strict=True)]
        off = [s - value for s, value in zip(seen, logged, strict=True)]
        if np.abs(off[0]).max() == 0.0:
            break
        motion = [values + more for values, more in zip(motion, off, strict=True)]
    index = np.concatenate([np.searchsorted(t, r.t[::EVERY] - STEP / 2) for r in case.records])
    return np.stack([part[np.minimum(index, len(t) - 1)] for part in ride.parts], axis=2)
