"""Effects evaluated again at the base model that was fitted beside them, until both agree.

The torque of an elastic or loose gear is linear in the base model's load and inertia. A base model that was fitted
without the effect has absorbed part of it, so the effect's first fit is biased.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect, accept_all_but
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.problem_setup import build_problem
from estimation.diagnosis.hypothesis_tests.refinement import refine
from estimation.diagnosis.joint_fits.extended_fit import dense
from estimation.diagnosis.joint_fits.total_torque import with_total_torque
from estimation.diagnosis.searches.refit import refit
from estimation.diagnosis.searches.selection import Selection
from estimation.diagnosis.searches.swap_search import remeasure
from robots.terms.effect_bases.capabilities import GearLoad

ROUNDS = 4
# Change of the effects' torque, as a share, below which base model and effects agree.
CONVERGED = 0.02


def relinearise(
    problem: Problem, selection: Selection, hypotheses: Sequence[Hypothesis]
) -> tuple[Problem, Problem, Selection]:
    """Repeats the joint fit of base model and selected effects until the effects change little.

    Args:
        problem: data of the search.
        selection: selected effects.
        hypotheses: of the catalogue.

    Returns:
        The data with the base model beside the effects, the same with the total torque where effects depend on it, and
        the selection with effects fitted there.
    """
    members = [found.effect for found in selection.found]
    if not any(member.hypothesis.effect.gear_load is GearLoad.FEELS for member in members):
        return problem, with_total_torque(problem, members, hypotheses), selection
    for _ in range(ROUNDS):
        before = [dense(problem, m.hypothesis, m.shape) @ m.coefficients for m in members]
        fitted = refit(with_total_torque(problem, members, hypotheses), members)
        posed = build_problem(
            problem.recording,
            problem.baseline,
            problem.whitening,
            extra=fitted.extra,
            followed=fitted.delayed,
            bearing=fitted.gear_load.extra_load,
        )
        problem = replace(posed, high_band=problem.high_band, timing=problem.timing)
        members = [replace(m, group=problem.measured(m.hypothesis, m.shape)) for m in members]
        for i, member in enumerate(members):
            members[i] = refine(problem, member.hypothesis, member.shape, accept_all_but(problem, members, i))
        members = _remeasured(problem, members)
        after = [dense(problem, m.hypothesis, m.shape) @ m.coefficients for m in members]
        changes = [np.sum((b - a) ** 2) / max(np.sum(a**2), 1e-300) for a, b in zip(before, after, strict=True)]
        if max(changes) < CONVERGED**2:
            break
    found = [replace(own, effect=member) for own, member in zip(selection.found, members, strict=True)]
    selection = replace(selection, found=tuple(sorted(found, key=lambda f: -f.effect.gain)))
    return problem, with_total_torque(problem, members, hypotheses), selection


def _remeasured(problem: Problem, members: Sequence[FittedEffect]) -> list[FittedEffect]:
    return [remeasure(problem, member, accept_all_but(problem, members, i)) for i, member in enumerate(members)]
