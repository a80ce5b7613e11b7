"""What friction that turns round does to a joint: reversals, and what a force about each of them does to its motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from estimation.diagnosis.recordings.periods import Cycle
from estimation.diagnosis.recordings.recording import Recording
from estimation.diagnosis.recordings.smoothed_motion import low_pass_gain
from robots.base_parameters import BaseParameters

Array = NDArray[np.float64]

# Reversals of which a mean is taken, and how fast against the usual one: a joint that creeps round kicks at no moment.
FEWEST, SLOWEST = 12, 0.2
# An inertia is no smaller anywhere than this share of the usual one.
LEAST = 0.1
# Edges [s] within which the force of a kick is constant, on either side of a reversal, for samples as close as [s].
# Within the first torque tells nothing of it: friction that turns round late would look the same.
CLOSE = 0.004
EDGES = (0.0, 0.006, 0.010, 0.014, 0.020, 0.028, 0.040, 0.056, 0.080, 0.112, 0.160, 0.200)
# A kick is over within this share of a period of the cut-off, and no sooner than this [s]; a low-pass spreads it by
# some periods more.
PERIODS, SHORTEST, RINGS = 1.0, 0.04, 2.0
FINE = 8  # points of tables in a sample
# A reversal stays the same one while it moves by less than this [s]; of a repeated motion it is by its phase [s].
MOVES, SAME = 0.02, 0.01
# Reversals in two logs are one and the same where positions and acceleration differ by this share of their range.
ALIKE = 2e-3


@dataclass(frozen=True, eq=False)
class ImpulseResponse:
    """What unit forces between each pair of edges do to a unit inertia, less what a low-pass leaves in the motion.

    Attributes:
        x: times from the reversal (T,) [s].
        values: positions, velocities, accelerations (3, T, K).
    """

    x: Array
    values: Array

    @staticmethod
    def of(cutoff: float, step: float, half: Array) -> ImpulseResponse:
        """Evaluates them for a low-pass [Hz], a sample period [s] and edges on one side [s]."""
        edges = np.concatenate([-half[:0:-1], half])
        dx = step / FINE
        count = int(np.ceil((half[-1] + RINGS / cutoff) / dx))
        x: Array = dx * np.arange(-count, count + 1, dtype=np.float64)
        low, high, at = edges[:-1], edges[1:], x[:, None]
        force = ((at >= low) & (at < high)).astype(float)
        speed = np.clip(at - low, 0.0, high - low)
        way = speed**2 / 2 + (high - low) * np.maximum(at - high, 0.0)
        # The loop undoes a kick: position and velocity are what they were, in the end.
        ends = np.stack([high - low, (high - low) ** 2 / 2 + (high - low) * (half[-1] - high)])
        free = np.linalg.svd(ends)[2][2:].T
        inside = np.abs(at) <= half[-1]
        whole = np.stack([np.where(inside, part, 0.0) @ free for part in (way, speed, force)])
        f = np.fft.rfftfreq(4 * len(x), dx)
        kept = np.fft.irfft(
            np.fft.rfft(whole, 4 * len(x), axis=1) * low_pass_gain(np.asarray(f), cutoff)[:, None], axis=1
        )
        return ImpulseResponse(x, whole - kept[:, : len(x)])

    def at(self, times: Array) -> Array:
        """Gives positions, velocities, accelerations (3, M, K) at times (M,) within."""
        place = np.clip((times - self.x[0]) / (self.x[1] - self.x[0]), 0, len(self.x) - 1.000001)
        low = place.astype(int)
        share = (place - low)[:, None]
        return np.asarray((1 - share) * self.values[:, low] + share * self.values[:, low + 1])


def edges_of(cutoff: float, step: float) -> Array:
    """Gives the edges on one side [s] for a low-pass [Hz] and a sample period [s]."""
    wider = max(1.0, step / CLOSE)
    edges = wider * np.array(EDGES)
    return edges[edges <= max(PERIODS / cutoff, wider * SHORTEST)]


@dataclass(frozen=True, eq=False)
class Reversals:
    """A joint's reversals in all logs.

    Attributes:
        at: moments (R,), in rows.
        way: signs (R,) of the acceleration.
        run: log (R,) of each.
        kind: number (R,) of each: those of a motion that is repeated, within a log or in others, have one.
        inertia: of the joint there (R,) [kg m2 or kg].
    """

    at: Array
    way: Array
    run: NDArray[np.intp]
    kind: NDArray[np.intp]
    inertia: Array


def find_reversals(recording: Recording, j: int, base: BaseParameters, values: Array) -> Reversals | None:
    """Finds the reversals of a joint (from 0), with base parameters (b,); None where they are too few."""
    at, rates, run, kind = [], [], [], []
    for k, rows in enumerate(recording.runs):
        moments, rate = _crossings(recording.dq[rows, j])
        at.append(rows.start + moments)
        rates.append(rate)
        run.append(np.full(len(moments), k))
        kind.append(_kinds(moments * recording.step, recording.cycles[k]))
    moments, rate, runs = (np.concatenate(parts) for parts in (at, rates, run))
    kinds = np.unique(np.column_stack([runs, np.concatenate(kind)]), axis=0, return_inverse=True)[1].ravel()
    if len(recording.runs) > 1 and len(kinds):
        numbers, spread = np.arange(len(recording)), np.maximum(np.ptp(recording.q, axis=0), 1e-9)
        place = np.column_stack([np.interp(moments, numbers, column) for column in (recording.q / spread).T])
        kinds = _alike(kinds, place, rate)
    fast = np.abs(rate) >= SLOWEST * np.median(np.abs(rate)) if len(rate) else np.zeros(0, dtype=bool)
    if fast.sum() < FEWEST:
        return None
    q = recording.q[np.round(moments[fast]).astype(int)]
    unit, zero = np.zeros_like(q), np.zeros_like(q)
    unit[:, j] = 1.0
    own = (base.torque(q, zero, unit, values) - base.torque(q, zero, zero, values))[:, j]
    usual = float(np.median(own))
    if usual <= 0:
        return None
    return Reversals(moments[fast], np.sign(rate[fast]), runs[fast], kinds[fast], np.maximum(own, LEAST * usual))


def _crossings(v: Array) -> tuple[Array, Array]:
    """Gives the moments [rows] at which a velocity (N,) changes its sign, and its changes from row to row there."""
    before = np.flatnonzero(v[1:] * v[:-1] < 0)
    rate = v[before + 1] - v[before]
    return before - v[before] / rate, rate


def _kinds(moments: Array, cycle: Cycle | None) -> NDArray[np.intp]:
    """Numbers reversals (R,) [s] by their phase in a repeated motion, or one by one."""
    if cycle is None or not len(moments):
        return np.arange(len(moments))
    phase = np.mod(moments, cycle.period)
    order = np.argsort(phase)
    number = np.empty(len(moments), dtype=np.intp)
    number[order] = np.cumsum(np.diff(phase[order], prepend=-np.inf) > SAME)
    return number


def _alike(kinds: NDArray[np.intp], q: Array, rate: Array) -> NDArray[np.intp]:
    """Numbers kinds (R,) anew, as one where all joints were in the same place (R, n) and this one turned alike (R,).

    Logs of one motion err alike in it: an encoder's steps are where they were.
    """
    counts = np.bincount(kinds)
    about = np.column_stack([q, rate / np.max(np.abs(rate))])
    mean = np.stack([np.bincount(kinds, column) / counts for column in about.T], axis=1)
    pairs = cKDTree(mean).query_pairs(ALIKE, p=np.inf, output_type="ndarray")
    links = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(len(counts), len(counts)))
    return np.asarray(connected_components(links, directed=False)[1][kinds], dtype=np.intp)


def impulse_columns(
    recording: Recording, turns: Reversals, at: Array, tables: list[ImpulseResponse]
) -> tuple[list[Array], NDArray[np.intp], Array]:
    """Gives what unit forces about reversals do (N, K), and how near those are.

    Args:
        recording: the data.
        turns: the reversals.
        at: their moments (R,), in rows.
        tables: of each log.

    Returns:
        Columns (N, K) of the position, of the velocity and of the torque; the nearest reversal (N,); how far it is (N,)
        [rows].
    """
    N, step = len(recording), recording.step
    columns = [np.zeros((N, tables[0].values.shape[2])) for _ in range(3)]
    away, nearest = np.full(N, np.inf), np.zeros(N, dtype=np.intp)
    for r, (moment, way, k, inertia) in enumerate(zip(at, turns.way, turns.run, turns.inertia, strict=True)):
        table, rows = tables[k], recording.runs[k]
        reach = table.x[-1] / step
        start, stop = max(rows.start, int(np.ceil(moment - reach))), min(rows.stop, int(moment + reach) + 1)
        here = way * table.at((np.arange(start, stop) - moment) * step)
        for whole, part in zip(columns, (here[0] / inertia, here[1] / inertia, here[2]), strict=True):
            whole[start:stop] += part
        far = np.abs(np.arange(start, stop) - moment)
        closer = far < away[start:stop]
        nearest[start:stop][closer] = r
        away[start:stop] = np.minimum(away[start:stop], far)
    return columns, nearest, away


def shift_reversals(recording: Recording, turns: Reversals, at: Array, dq: Array) -> Array:
    """Moves reversals (R,) to where a velocity (N,) has its own nearest to them, if that is near."""
    own, rate = _crossings(dq)
    result = at.copy()
    for way in (-1.0, 1.0):
        same, chosen = own[np.sign(rate) == way], turns.way == way
        if len(same) and chosen.any():
            found = same[np.abs(same[None, :] - at[chosen, None]).argmin(axis=1)]
            result[chosen] = np.where(np.abs(found - at[chosen]) * recording.step < MOVES, found, at[chosen])
    return result
