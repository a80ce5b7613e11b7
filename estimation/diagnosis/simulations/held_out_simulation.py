"""Forward simulation of the stretch of held-out data in which the effects are strongest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.base_models.priors import solve_map
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.simulations.forward_simulation import FittedRobot, simulate_both
from estimation.diagnosis.simulations.simulation_result import Simulation
from estimation.diagnosis.validations.gain_intervals import model_columns
from estimation.diagnosis.validations.held_out_errors import HeldOutResult, found_in_one_log_only, split_runs

Array = NDArray[np.float64]

# Duration of the simulated stretch [s], and largest number of rows of the fit for it.
STRETCH = 5.0
ENOUGH_ROWS = 12_000


def simulate_held_out(
    problem: Problem, members: Sequence[FittedEffect], measured: HeldOutResult, held_out: bool
) -> Simulation | None:
    """Simulates the stretch of held-out data in which the effects are strongest, without and with them.

    Args:
        problem: data of the fit.
        members: findings, at least one.
        measured: held-out results of these members.
        held_out: whether there are held-out logs. If not, the fit leaves out the part with the stretch.

    Returns:
        The simulation; None if the simulated motion diverges.
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
    """Finds the window of `length` rows with the largest mean of `strength` (N,), and the part that contains it."""
    sums = np.concatenate([[0.0], np.cumsum(strength)])
    best, chosen = -1.0, (parts[0], parts[0])
    for part in parts:
        size = min(length, part.stop - part.start)
        for start in range(part.start, part.stop - size + 1, max(1, size // 4)):
            mean = float(sums[start + size] - sums[start]) / size
            # Shorter windows are weighted down: their mean varies more by chance.
            value = mean * min(1.0, size / length)
            if value > best:
                best, chosen = value, (part, slice(start, start + size))
    return chosen


def _fits(problem: Problem, measured: HeldOutResult, left_out: slice | None) -> tuple[Array, Array]:
    """Fits base model and nuisance, without and with the effects, to all rows except those left out."""
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
    # Compensates the decimation, so that the prior keeps its weight.
    factor = kept.sum() / max(len(rows), 1)
    alone, *_, everything = model_columns(full.shape[2] - sum(X.shape[2] for X in effects), effects)
    first, last = (
        solve_map(factor * gram[np.ix_(chosen, chosen)], factor * cross[chosen], measured.prior.columns(chosen))
        for chosen in (alone, everything)
    )
    return first, last
