"""Window of a transient effect: where it ends, and where a formula that holds throughout explains most."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.calibration import MIN_BIC_GAIN
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine
from estimation.diagnosis.hypothesis_tests.scoring import Accepted, accept
from robots.common.arrays import Array
from robots.common.parallel import threaded
from robots.terms.effect_bases.capabilities import Persistence

# Share of its chi-square that a finer search of an event's window may add.
MIN_WINDOW_GAIN = 0.1


def open_event_edges(
    problem: Problem, member: FittedEffect, others: Sequence[FittedEffect], errors: Sequence[float]
) -> list[float]:
    """Sets the errors of window edges to infinity where the data show that the effect continues.

    A contact with a moving arm is not a pulse of constant joint torques. Such a pulse fits where the contact is
    largest, so its sharp edges are not those of the contact.

    Args:
        problem: data and base model.
        member: the effect.
        others: other effects found.
        errors: standard errors of its shape parameters.

    Returns:
        The errors (s,), infinite for open edges.
    """
    open_ = _open(problem, member, accept(problem, tuple(m.group for m in others)))
    return [np.inf if k in open_ else error for k, error in enumerate(errors)]


def refit_event_window(problem: Problem, member: FittedEffect, beside: Accepted) -> FittedEffect:
    """Refits a transient effect by a formula that holds for its whole duration, if the BIC improves.

    Args:
        problem: data and base model.
        member: the effect; others than transient ones are returned unchanged.
        beside: groups already in the model.
    """
    hypothesis = member.hypothesis
    if hypothesis.effect.persistence is not Persistence.TRANSIENT:
        return member
    shapes = hypothesis.effect.sustained_shapes(problem.state_for(hypothesis.effect), member.shape)
    if not shapes:
        return member
    start, duration = member.shape[:2]
    windows = threaded(lambda shape: best_window(problem, hypothesis, shape, beside, (start, start + duration)), shapes)
    forms = [(own.gain, (own.start, own.duration, *shape[2:])) for own, shape in zip(windows, shapes, strict=True)]
    near = refine(problem, hypothesis, max(forms)[1], beside, effort=0)
    if near.bic_gain + MIN_WINDOW_GAIN * near.gain < member.bic_gain:
        return member
    best = refine(problem, hypothesis, near.shape, beside)
    return best if best.bic_gain > member.bic_gain + MIN_BIC_GAIN else member


def _open(problem: Problem, member: FittedEffect, beside: Accepted) -> set[int]:
    """Returns the indices of shape parameters at which the effect continues."""
    further = member.hypothesis.effect.open_edges(member.shape)
    if not further:
        return set()
    rest = accept(problem, (member.group, *beside.groups))
    more = ((k, refine(problem, member.hypothesis, shape, rest, effort=0)) for k, shape in further)
    return {k for k, form in more if form.local_bic_gain > MIN_BIC_GAIN}


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
