"""Effects evaluated again at the base model that is fitted beside them, until both agree.

The torque of an elastic or loose gear is linear in the base model's load and inertia. A base model that was fitted
without the effect has absorbed part of it, so the effect's first fit is biased.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimation.diagnosis.base_models.priors import solve_map
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect, accept_all_but
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine
from estimation.diagnosis.joint_fits.extended_fit import dense
from estimation.diagnosis.searches.swap_search import remeasure
from estimation.regressions.parameter_priors import GaussianPrior
from robots.terms.effect_bases.capabilities import AtReversals, Reading
from robots.terms.effect_bases.gear_load import with_gear_load

ROUNDS = 3
# Change of the effects' torque, as a share, below which base model and effects agree.
CONVERGED = 0.03
# Evaluations per shape parameter in each round: the shapes change little.
EFFORT = 10


def relinearise(problem: Problem, members: Sequence[FittedEffect]) -> tuple[Problem, list[FittedEffect]]:
    """Repeats the fits of base model and effects until the effects change little.

    Only effects that follow accelerations need this. Effects on the reading of the torque exclude it.

    Args:
        problem: whitened data.
        members: effects in the model.

    Returns:
        The data with the base model beside the effects, and the effects fitted there.
    """
    effects = [member.hypothesis.effect for member in members]
    driven = any(effect.at_reversals is AtReversals.IMPACT for effect in effects)
    if not driven or any(effect.reading is not Reading.ADDS for effect in effects):
        return problem, list(members)
    members = list(members)
    torques = [dense(problem, m.hypothesis, m.shape) @ m.coefficients for m in members]
    for _ in range(ROUNDS):
        problem = _with_base_model_beside(problem, np.sum(torques, axis=0))
        members = [replace(m, group=problem.measured(m.hypothesis, m.shape)) for m in members]
        for i, member in enumerate(members):
            members[i] = refine(
                problem,
                member.hypothesis,
                member.shape,
                accept_all_but(problem, members, i),
                effort=EFFORT,
                others=False,
            )
        members = [remeasure(problem, m, accept_all_but(problem, members, i)) for i, m in enumerate(members)]
        before, torques = torques, [dense(problem, m.hypothesis, m.shape) @ m.coefficients for m in members]
        changes = [np.sum((b - a) ** 2) / max(np.sum(a**2), 1e-300) for a, b in zip(before, torques, strict=True)]
        if max(changes) < CONVERGED**2:
            break
    return problem, members


def _with_base_model_beside(problem: Problem, extra: np.ndarray) -> Problem:
    """Fits the base model to the whitened torque without that of effects (N, n), and evaluates the situation there."""
    baseline, white = problem.baseline, problem.whitening
    flat = white.independent(np.concatenate([baseline.regressor, baseline.nuisance], axis=2))
    tau = white.independent(problem.recording.tau - extra)
    pull = GaussianPrior(problem.prior.precision / white.row_weight, problem.prior.target)
    values = solve_map(flat.T @ flat, flat.T @ tau, pull)[: baseline.base.size]
    now = with_gear_load(baseline.situation(problem.recording, values), problem.extra_load)
    return replace(problem, situation=now)
