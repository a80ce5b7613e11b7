"""The intervals on which a run's temperatures are polynomials, and what acts on the joint in each."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import casadi
import numpy as np
from scipy.sparse import csr_matrix

from estimation.thermal.runs.thermal_run import ThermalRun
from robots.common.arrays import Array

COLLOCATION_DEGREE = 3


@dataclass(frozen=True, kw_only=True)
class MeshSettings:
    """How fine the mesh is.

    Attributes:
        first: length of the first interval after the power has changed [s].
        growth: of each interval over the one before.
        longest: an interval's share of the run.
        cap: longest interval [s].
    """

    first: float = 5.0
    growth: float = 1.7
    longest: float = 1.0 / 30.0
    cap: float = 240.0

    def finer(self) -> MeshSettings:
        """Halves all steps."""
        return MeshSettings(first=self.first / 2, growth=self.growth**0.5, longest=self.longest / 2, cap=self.cap / 2)


def radau() -> tuple[Array, Array]:
    """Gives the Radau points with zero in front (d + 1,), and the derivatives D (d + 1, d) of the Lagrange basis."""
    points = np.array([0.0, *casadi.collocation_points(COLLOCATION_DEGREE, "radau")])
    D = np.empty((COLLOCATION_DEGREE + 1, COLLOCATION_DEGREE))
    for j in range(COLLOCATION_DEGREE + 1):
        basis = np.poly1d([1.0])
        for r in range(COLLOCATION_DEGREE + 1):
            if r != j:
                basis *= np.poly1d([1.0, -points[r]]) / (points[j] - points[r])
        D[j] = np.polyval(np.polyder(basis), points[1:])
    return points, D


@dataclass(frozen=True, kw_only=True, eq=False)
class Mesh:
    """A run on its intervals.

    Attributes:
        edges: of the K intervals (K + 1,) [s].
        power: mean in each interval (K,) [W].
        drives: mean in each interval (K,).
        ambient: at the Radau points (K, d) [degC]; None where it is not known.
        T3: at the Radau points (K, d) [degC]; None where it was not measured.
        sampling: (N, 1 + K d): values at the run's times from those at the start and at the Radau points.
    """

    edges: Array
    power: Array
    drives: Array
    ambient: Array | None
    T3: Array | None
    sampling: csr_matrix

    @property
    def count(self) -> int:
        """Number of intervals."""
        return len(self.power)


def build_mesh(run: ThermalRun, settings: MeshSettings) -> Mesh:
    """Cuts a run into intervals: short where the power has just changed, longer after."""
    t, steps = run.t, np.diff(run.t)
    edges = _edges(run, settings)
    heat = np.concatenate([[0.0], np.cumsum(run.held_power * steps)])
    on = np.concatenate([[0.0], np.cumsum(np.asarray(run.drives)[:-1] * steps)])
    lengths = np.diff(edges)
    points, _ = radau()
    inside = edges[:-1, None] + lengths[:, None] * points[1:]

    def at_points(values: Array | float | None) -> Array | None:
        if values is None:
            return None
        array = np.asarray(values)
        seen = np.isfinite(array)
        return np.asarray(np.interp(inside, t[seen], array[seen])) if seen.any() else None

    return Mesh(
        edges=edges,
        power=np.maximum(np.diff(np.interp(edges, t, heat)) / lengths, 0.0),
        drives=np.clip(np.diff(np.interp(edges, t, on)) / lengths, 0.0, 1.0),
        ambient=at_points(run.ambient),
        T3=at_points(run.T3),
        sampling=_sampling(t, edges, points),
    )


def _edges(run: ThermalRun, settings: MeshSettings) -> Array:
    power, t = run.held_power, run.t
    tolerance = 1e-9 * max(float(power.max()), 1e-12)
    drives = np.asarray(run.drives)[:-1]
    changes = np.flatnonzero((np.abs(np.diff(power)) > tolerance) | (np.diff(drives) != 0.0)) + 1
    longest = min(settings.longest * run.duration, settings.cap)
    # More changes of the power than this are no stages of an experiment but a motion: its steps are merged.
    most = 240
    if len(changes) > most:
        return np.linspace(t[0], t[-1], min(most, int(np.ceil(run.duration / settings.first))) + 1)
    breaks = np.concatenate([[t[0]], t[changes], [t[-1]]])
    edges = [float(t[0])]
    for start, stop in pairwise(breaks):
        lengths: list[float] = []
        total = 0.0
        while total < stop - start:
            lengths.append(min(settings.first * settings.growth ** len(lengths), longest))
            total += lengths[-1]
        scaled = np.array(lengths) * (stop - start) / total
        edges.extend((start + np.cumsum(scaled)).tolist())
        edges[-1] = float(stop)
    return np.array(edges)


def _sampling(t: Array, edges: Array, points: Array) -> csr_matrix:
    """Lagrange's interpolation in the interval that holds each time."""
    interval = np.clip(np.searchsorted(edges, t, side="left") - 1, 0, len(edges) - 2)
    place = (t - edges[interval]) / np.diff(edges)[interval]
    rows, columns, values = [], [], []
    for j in range(COLLOCATION_DEGREE + 1):
        basis = np.ones(t.shape)
        for r in range(COLLOCATION_DEGREE + 1):
            if r != j:
                basis *= (place - points[r]) / (points[j] - points[r])
        rows.append(np.arange(len(t)))
        # The start of an interval is the last Radau point of the one before.
        columns.append(interval * COLLOCATION_DEGREE + j)
        values.append(basis)
    shape = (len(t), 1 + (len(edges) - 1) * COLLOCATION_DEGREE)
    return csr_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=shape)
