"""Velocity reversals of a joint, and the response of its motion to a force about each of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from estimation.diagnosis.recordings.recording import Recording
from estimation.diagnosis.recordings.smoothed_motion import low_pass_gain
from estimation.preprocessing import Cycle
from robots.base_parameters import BaseParameters
from robots.common.arrays import Array

# Fewest reversals for an average, and least acceleration of one over their median: slow reversals have no sharp pulse.
FEWEST, SLOWEST = 12, 0.2
# Lower bound of a joint's inertia, as a share of its median.
LEAST = 0.1
# Edges [s] of the intervals on either side of a reversal in which the force is constant, for sample periods up to
# `CLOSE`. Torque within the first edge is not used: late friction would look the same there.
CLOSE = 0.004
EDGES = (0.0, 0.006, 0.010, 0.014, 0.020, 0.028, 0.040, 0.056, 0.080, 0.112, 0.160, 0.200)
# The force ends within `PERIODS` periods of the cut-off, but not before `SHORTEST` [s]. The low-pass spreads the
# response by `RINGS` periods more.
PERIODS, SHORTEST, RINGS = 1.0, 0.04, 2.0
FINE = 8  # table points per sample period
# A reversal that moves by less than `MOVES` [s] is still the same. In a periodic motion, reversals are the same if
# their phases differ by less than `SAME` [s].
MOVES, SAME = 0.02, 0.01
# Reversals in two logs are the same if positions and accelerations differ by less than this share of their range.
ALIKE = 2e-3


@dataclass(frozen=True, eq=False)
class ImpulseResponse:
    """Response of a unit inertia to force pulses about a reversal, minus what the low-pass keeps of it.

    Pulses are combinations of unit forces between two edges each, after which position and velocity return to zero.

    Attributes:
        x: times from the reversal (T,) [s].
        values: positions, velocities and accelerations (3, T, K).
    """

    x: Array
    values: Array

    @staticmethod
    @lru_cache(maxsize=16)
    def of(cutoff: float, step: float, edges: tuple[float, ...]) -> ImpulseResponse:
        """Evaluates the response for a low-pass [Hz], a sample period [s] and the edges on one side [s]."""
        half = np.array(edges)
        both = np.concatenate([-half[:0:-1], half])
        dx = step / FINE
        count = int(np.ceil((half[-1] + RINGS / cutoff) / dx))
        x: Array = dx * np.arange(-count, count + 1, dtype=np.float64)
        low, high, at = both[:-1], both[1:], x[:, None]
        force = ((at >= low) & (at < high)).astype(float)
        speed = np.clip(at - low, 0.0, high - low)
        way = speed**2 / 2 + (high - low) * np.maximum(at - high, 0.0)
        # The position loop compensates the pulse: position and velocity return to their values without it.
        ends = np.stack([high - low, (high - low) ** 2 / 2 + (high - low) * (half[-1] - high)])
        free = np.linalg.svd(ends)[2][2:].T
        inside = np.abs(at) <= half[-1]
        whole = np.stack([np.where(inside, part, 0.0) @ free for part in (way, speed, force)])
        length = next_fast_len(4 * len(x), real=True)
        gain = low_pass_gain(np.asarray(np.fft.rfftfreq(length, dx)), cutoff)
        kept = irfft(rfft(whole, length, axis=1) * gain[:, None], length, axis=1)
        return ImpulseResponse(x, whole - kept[:, : len(x)])

    def at(self, times: Array) -> Array:
        """Interpolates positions, velocities and accelerations (3, M, K) at times (M,) [s] from the reversal."""
        place = np.clip((times - self.x[0]) / (self.x[1] - self.x[0]), 0, len(self.x) - 1.000001)
        low = place.astype(int)
        share = (place - low)[:, None]
        return np.asarray((1 - share) * self.values[:, low] + share * self.values[:, low + 1])

    @property
    def most(self) -> int:
        """The largest number of sample periods in the table."""
        return (len(self.x) - 2) // FINE + 1

    def sampled(self, first: float, count: int) -> Array:
        """Interpolates as `at` does, at `count` sample periods from a first time [s] on, all of them in the table."""
        place = (first - self.x[0]) / (self.x[1] - self.x[0])
        low = min(max(int(place), 0), len(self.x) - 2 - FINE * (count - 1))
        share, stop = place - low, low + FINE * (count - 1) + 1
        before, after = self.values[:, low:stop:FINE], self.values[:, low + 1 : stop + 1 : FINE]
        return np.asarray((1 - share) * before + share * after)


def edges_of(cutoff: float, step: float) -> tuple[float, ...]:
    """Returns the edges on one side of a reversal [s], for a low-pass [Hz] and a sample period [s]."""
    wider = max(1.0, step / CLOSE)
    edges = wider * np.array(EDGES)
    return tuple(edges[edges <= max(PERIODS / cutoff, wider * SHORTEST)].tolist())


@dataclass(frozen=True, eq=False)
class Reversals:
    """Reversals of a joint in all logs.

    Attributes:
        at: times (R,), in rows.
        way: signs (R,) of the acceleration.
        run: index (R,) of the log.
        kind: label (R,); repetitions of a reversal, within a log or between logs, share one.
        inertia: inertia of the joint at each reversal (R,) [kg m2 or kg].
    """

    at: Array
    way: Array
    run: NDArray[np.intp]
    kind: NDArray[np.intp]
    inertia: Array


def find_reversals(recording: Recording, j: int, base: BaseParameters, values: Array) -> Reversals | None:
    """Finds the reversals of a joint.

    Args:
        recording: the data.
        j: the joint, counted from 0.
        base: base parameters of the model.
        values: their values (b,), which yield the inertia.

    Returns:
        The reversals; None if there are too few.
    """
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
    """Returns the times [rows] at which a velocity (N,) changes sign, and its change per row there."""
    before = np.flatnonzero(v[1:] * v[:-1] < 0)
    rate = v[before + 1] - v[before]
    return before - v[before] / rate, rate


def _kinds(moments: Array, cycle: Cycle | None) -> NDArray[np.intp]:
    """Labels reversals (R,) [s] by their phase in a periodic motion, or one by one."""
    if cycle is None or not len(moments):
        return np.arange(len(moments))
    phase = np.mod(moments, cycle.period)
    order = np.argsort(phase)
    number = np.empty(len(moments), dtype=np.intp)
    number[order] = np.cumsum(np.diff(phase[order], prepend=-np.inf) > SAME)
    return number


def _alike(kinds: NDArray[np.intp], q: Array, rate: Array) -> NDArray[np.intp]:
    """Merges labels (R,) of reversals with the same positions of all joints (R, n) and the same acceleration (R,).

    Logs of the same motion have the same errors at them, because the encoder steps are at the same positions.
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
    """Evaluates the response to unit pulses about all reversals.

    Args:
        recording: the data.
        turns: the reversals.
        at: their times (R,), in rows.
        tables: response for each log.

    Returns:
        Columns (N, K) of position, velocity and torque; the index of the nearest reversal (N,); the distance to it (N,)
        [rows].
    """
    N, step = len(recording), recording.step
    columns = [np.zeros((N, tables[0].values.shape[2])) for _ in range(3)]
    away, nearest = np.full(N, np.inf), np.zeros(N, dtype=np.intp)
    runs = recording.runs
    for r, (moment, way, k, inertia) in enumerate(zip(at, turns.way, turns.run, turns.inertia, strict=True)):
        table, rows = tables[k], runs[k]
        reach = table.x[-1] / step
        start = max(rows.start, int(np.ceil(moment - reach)))
        stop = min(rows.stop, int(moment + reach) + 1, start + table.most)
        if stop <= start:
            continue
        here = table.sampled((start - moment) * step, stop - start)
        for whole, part, scale in zip(columns, here, (way / inertia, way / inertia, way), strict=True):
            part *= scale
            whole[start:stop] += part
        far = np.abs(np.arange(start, stop) - moment)
        closer = far < away[start:stop]
        nearest[start:stop][closer] = r
        away[start:stop] = np.minimum(away[start:stop], far)
    return columns, nearest, away


def shift_reversals(recording: Recording, turns: Reversals, at: Array, dq: Array) -> Array:
    """Moves reversals (R,) to the nearest sign change of a velocity (N,) in the same direction, if it is near."""
    own, rate = _crossings(dq)
    result = at.copy()
    for way in (-1.0, 1.0):
        same, chosen = own[np.sign(rate) == way], turns.way == way
        if len(same) and chosen.any():
            after = np.clip(np.searchsorted(same, at[chosen]), 1, max(len(same) - 1, 1))
            beside = same[np.stack([after - 1, np.minimum(after, len(same) - 1)])]
            found = np.take_along_axis(beside, np.abs(beside - at[chosen]).argmin(axis=0)[None], axis=0)[0]
            result[chosen] = np.where(np.abs(found - at[chosen]) * recording.step < MOVES, found, at[chosen])
    return result
