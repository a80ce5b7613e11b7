"""Forward simulation of the stretch of held-out data in which the extension acts most."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.base_models.priors import solve_map
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import FittedEffect
from estimation.diagnosis.validations.forward_simulation import FittedRobot, simulate_both
from estimation.diagnosis.validations.gain_intervals import model_columns
from estimation.diagnosis.validations.held_out_errors import HeldOutResult, found_in_one_log_only, split_runs
from estimation.diagnosis.validations.simulation_result import Simulation

Array = NDArray[np.float64]

# Of this many seconds of unseen data the motion is simulated, by a fit to at most so many rows.
STRETCH = 5.0
ENOUGH_ROWS = 12_000


def simulate_held_out(
    problem: Problem, members: Sequence[FittedEffect], measured: HeldOutResult, held_out: bool
) -> Simulation | None:
    """Simulates the stretch of unseen data in which the extension acts most, without and with it.

    Args:
        problem: the data of the fit.
        members: what was found, at least one.
        measured: of these members.
        held_out: whether logs were kept apart; else the fit leaves out the part in which the stretch lies.

    Returns:
        The simulation; None where the fitted robot runs away from the loop.
    """
    whole, first = measured.whole, measured.first_held_out_row
    parts = [slice(max(run.start, first), run.stop) for run in whole.runs if run.stop > first]
    if not held_out and (len(parts) == 1 or found_in_one_log_only(whole, measured.effects)):
        parts = split_runs(whole)
    strength = np.sum((measured.torque / problem.whitening.scale) ** 2, axis=1)
    part, rows = _strongest(parts, np.concatenate([np.zeros(first), strength]), round(STRETCH / whole.step))
    base, extended = _fits(problem, measured, None if held_out else part)
    known = problem.baseline.base
    b = known.size
    before = FittedRobot(model=known.model, columns=known.independent, values=base[:b])
    edges = np.cumsum([b + problem.baseline.nuisance.shape[2], *(X.shape[2] for X in measured.effects)])
    there = [i for i in range(len(members)) if i not in measured.absent]
    after = replace(
        before,
        values=extended[:b],
        base_values_for_effects=problem.parameters_without_payload[list(known.independent)],
        extra_load=problem.extra_load,
        since=problem.situation.origin,
        members=tuple(members[i] for i in there),
        coefficients=tuple(extended[edges[i] : edges[i + 1]] for i in there),
    )
    return simulate_both(before, after, whole, rows)


def _strongest(parts: Sequence[slice], strength: Array, length: int) -> tuple[slice, slice]:
    """Finds the window of some rows in which a signal (N,) is strongest, and the part in which it lies."""
    sums = np.concatenate([[0.0], np.cumsum(strength)])
    best, chosen = -1.0, (parts[0], parts[0])
    for part in parts:
        size = min(length, part.stop - part.start)
        for start in range(part.start, part.stop - size + 1, max(1, size // 4)):
            mean = float(sums[start + size] - sums[start]) / size
            # A longer window goes before a short one that is hardly stronger by chance.
            value = mean * min(1.0, size / length)
            if value > best:
                best, chosen = value, (part, slice(start, start + size))
    return chosen


def _fits(problem: Problem, measured: HeldOutResult, left_out: slice | None) -> tuple[Array, Array]:
    """Fits base model and nuisance alone, and with the effects, to all rows but those left out."""
    recording, effects = problem.recording, measured.effects
    kept = np.ones(len(recording), dtype=bool)
    if left_out is not None:
        kept[left_out] = False
    rows = np.flatnonzero(kept)
    rows = rows[:: max(1, -(-len(rows) // ENOUGH_ROWS))]
    full = np.concatenate(
        [problem.baseline.regressor[rows], problem.baseline.nuisance[rows], *(X[rows] for X in effects)], axis=2
    )
    weights = (~recording.sign_unknown / problem.whitening.scales(len(recording)))[rows]
    flat = (full * weights[:, :, None]).reshape(-1, full.shape[2])
    gram, cross = flat.T @ flat, flat.T @ (recording.tau[rows] * weights).reshape(-1)
    # Thinned rows count for all.
    factor = kept.sum() / max(len(rows), 1)
    alone, *_, everything = model_columns(full.shape[2] - sum(X.shape[2] for X in effects), effects)
    first, last = (
        solve_map(factor * gram[np.ix_(chosen, chosen)], factor * cross[chosen], measured.prior.columns(chosen))
        for chosen in (alone, everything)
    )
    return first, last
