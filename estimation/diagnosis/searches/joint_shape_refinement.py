"""Joint refinement of the shapes of several effects on one joint, which converges slowly one at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect, accept_all_but
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine
from estimation.diagnosis.hypothesis_tests.scoring import accept
from robots.terms.effect_bases.capabilities import Reading

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
