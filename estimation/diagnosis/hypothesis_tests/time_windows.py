"""Search for the time window in which a formula that holds throughout the log explains most."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.scoring import Accepted

Array = NDArray[np.float64]
Small = NDArray[np.float32]

# Spacing of the window edges [s] in the coarse and the fine search, and their reach beyond the known window [s].
COARSE, FINE, BESIDE = 0.5, 0.05, 60.0
# FAINT regularises nearly dependent columns, as a share of their energy. ROUNDING: share of a column's energy over the
# whole log below which a window has only rounding errors.
FAINT, ROUNDING = 1e-5, 1e-10


@dataclass(frozen=True)
class Window:
    """The best window of one formula.

    Attributes:
        gain: chi-square explained there, without allowing for the base model's share in it.
        start: [s].
        duration: [s].
    """

    gain: float
    start: float
    duration: float


def best_window(
    problem: Problem, hypothesis: Hypothesis, shape: tuple[float, ...], beside: Accepted, known: tuple[float, float]
) -> Window:
    """Finds the window around a known one in which the columns explain most.

    The whitened columns of a window equal those of the whole log inside it, except near its ends. Differences of
    cumulative sums therefore give the products of each window.

    Args:
        problem: data and base model.
        hypothesis: effect and joint.
        shape: shape values for which the columns act throughout the log.
        beside: groups already in the model.
        known: start and end of the known window [s].
    """
    rows = _independent(problem, hypothesis, shape)
    left = (problem.white - beside.torque(problem.white)) @ np.linalg.cholesky(problem.whitening.precision)
    middle = sum(known) / 2
    times, log = _times(problem, middle)
    edges = np.arange(max(known[0] - BESIDE, times[log[0]]), min(known[1] + BESIDE, times[log[1] - 1]) + COARSE, COARSE)
    coarse = _look(rows, left, times, log, edges[edges <= middle], edges[edges > middle])
    near = np.arange(-1.5 * COARSE, 1.5 * COARSE + FINE, FINE)
    return _look(rows, left, times, log, coarse.start + near, coarse.start + coarse.duration + near)


def _independent(problem: Problem, hypothesis: Hypothesis, shape: tuple[float, ...]) -> Small:
    """Returns white columns (N, n, k), also independent across joints."""
    joints, columns = problem.columns_of(hypothesis, shape)
    root = np.linalg.cholesky(problem.whitening.precision)
    total = np.zeros((problem.rows, problem.n, columns[0].shape[1]), np.float32)
    for j, part in zip(joints, columns, strict=True):
        white = problem.whitening.apply(part, j)
        total += root[j].astype(np.float32)[None, :, None] * white.astype(np.float32)[:, None, :]
    return total


def _times(problem: Problem, moment: float) -> tuple[Array, tuple[int, int]]:
    """Returns the times (N,) [s] of the white rows, and the first and end row of the log at a given time."""
    parts, log, first = [], (0, problem.rows), 0
    for run in problem.situation.runs:
        own = problem.situation.t[run][:: problem.whitening.stride]
        if own[0] <= moment <= own[-1]:
            log = (first, first + len(own))
        parts.append(own)
        first += len(own)
    return np.concatenate(parts), log


def _look(rows: Small, left: Array, times: Array, log: tuple[int, int], starts: Array, ends: Array) -> Window:
    """Finds the best of all windows from one of the starts to one of the ends."""
    first, last = log
    moments = np.unique(np.concatenate([starts, ends]))
    places = first + np.searchsorted(times[first:last], moments)
    k = rows.shape[2]
    grams, crosses = np.zeros((len(moments), k, k)), np.zeros((len(moments), k))
    for i, (a, b) in enumerate(pairwise(places)):
        part = rows[a:b].reshape(-1, k).astype(float)
        grams[i + 1], crosses[i + 1] = part.T @ part, part.T @ left[a:b].reshape(-1)
    grams, crosses = grams.cumsum(axis=0), crosses.cumsum(axis=0)
    begin, end = np.searchsorted(moments, starts), np.searchsorted(moments, ends)
    gains = np.zeros((len(begin), len(end)))
    # Differences of cumulative sums have rounding errors of this size.
    least = ROUNDING * np.maximum(np.einsum("kk->k", grams[-1]), np.finfo(float).tiny)
    for i, at in enumerate(begin):
        later = np.flatnonzero(end > at)
        gram, cross = grams[end[later]] - grams[at], crosses[end[later]] - crosses[at]
        scale = np.sqrt(np.maximum(np.einsum("mkk->mk", gram), least))
        unit = gram / scale[:, :, None] / scale[:, None, :] + FAINT * np.eye(k)
        gains[i, later] = ((cross / scale) * np.linalg.solve(unit, (cross / scale)[:, :, None])[:, :, 0]).sum(axis=1)
    one, other = np.unravel_index(int(np.argmax(gains)), gains.shape)
    return Window(float(gains[one, other]), float(starts[one]), float(ends[other] - starts[one]))
