"""Refinement of several effects together: with the base model beside them, and of shapes on one joint.

The torque of an elastic or loose gear is linear in the base model's load and inertia. A base model that was fitted
without the effect has absorbed part of it, so the effect's first fit is biased.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect, accept_all_but
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine
from estimation.diagnosis.hypothesis_tests.scoring import accept
from estimation.diagnosis.searches.swap_search import remeasure
from robots.terms.effect_bases.capabilities import AtReversals, Reading
from robots.terms.effect_bases.gear_load import with_gear_load

RELINEARISATIONS = 3
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
    torques = [m.torque(problem) for m in members]
    for _ in range(RELINEARISATIONS):
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
        before, torques = torques, [m.torque(problem) for m in members]
        changes = [np.sum((b - a) ** 2) / max(np.sum(a**2), 1e-300) for a, b in zip(before, torques, strict=True)]
        if max(changes) < CONVERGED**2:
            break
    return problem, members


def _with_base_model_beside(problem: Problem, extra: np.ndarray) -> Problem:
    """Fits the base model to the whitened torque without that of effects (N, n), and evaluates the situation there."""
    baseline, white = problem.baseline, problem.whitening
    moments = white.moments(baseline.columns, problem.recording.tau - extra)
    values = moments.pulled(problem.prior.times(1.0 / white.row_weight)).posterior()[: baseline.base.size]
    now = with_gear_load(baseline.situation(problem.recording, values), problem.extra_load)
    return replace(problem, situation=now)


ROUNDS = 8  # largest number of rounds
# Gain of chi2 by a round below which the refinement stops.
LEAST_GAIN = 1.0
# Multiples of the step of a round that are tried, as long as the gain increases.
FACTORS = (1.0, 2.0, 4.0, 8.0, 16.0)


def refine_shapes_jointly(problem: Problem, members: Sequence[FittedEffect]) -> list[FittedEffect]:
    """Refines the shapes of members that share a joint until they converge.

    One round refines each member beside the others. All members then repeat their steps together (pattern moves, Hooke
    and Jeeves 1961). Two formulas may share part of the torque, which one can release only as the other takes it up.

    Args:
        problem: whitened data.
        members: effects in the model.

    Returns:
        The members with refined shapes.
    """
    result = list(members)
    for joint in sorted({m.hypothesis.joint for m in members if m.hypothesis.joint is not None}):
        own = [i for i, m in enumerate(result) if m.hypothesis.joint == joint and m.shape]
        # Effects on the total torque depend on the torque of the other effects, which is fixed here.
        if len(own) > 1 and not any(result[i].hypothesis.effect.reading is Reading.CUTS for i in own):
            _along(problem, result, own)
    return result


def _along(problem: Problem, members: list[FittedEffect], own: Sequence[int]) -> None:
    """Refines the members with the indices `own`, in place."""
    gain = _explained(problem, members)
    for left in reversed(range(ROUNDS)):
        before = [members[i] for i in own]
        for i in own:
            beside = accept_all_but(problem, members, i)
            members[i] = refine(problem, members[i].hypothesis, members[i].shape, beside)
        more = _explained(problem, members) - gain
        # The last step must be a refinement, because it determines which shape parameters are free.
        if more < LEAST_GAIN or not left:
            break
        gain += more
        after = [members[i] for i in own]
        for factor in FACTORS:
            shapes = [_further(problem, a, b, factor) for a, b in zip(before, after, strict=True)]
            trial = list(members)
            for i, shape in zip(own, shapes, strict=True):
                trial[i] = replace(members[i], shape=shape, group=problem.measured(members[i].hypothesis, shape))
            if (reached := _explained(problem, trial)) <= gain:
                break
            gain, members[:] = reached, trial


def _explained(problem: Problem, members: Sequence[FittedEffect]) -> float:
    return accept(problem, tuple(member.group for member in members)).gain


def _further(problem: Problem, before: FittedEffect, after: FittedEffect, factor: float) -> tuple[float, ...]:
    """Extrapolates the step from one shape to another by a factor, within bounds."""
    effect, joint = after.hypothesis.effect, after.hypothesis.joint
    shape = []
    for (low, high), described, a, b in zip(
        effect.bounds(problem.state_for(effect), joint), effect.shapes, before.shape, after.shape, strict=True
    ):
        further = b * (b / a) ** factor if described.scale == "log" and a > 0 < b else b + factor * (b - a)
        shape.append(float(np.clip(further, low, high)))
    return tuple(shape)
