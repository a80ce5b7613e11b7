"""Shapes of several effects on one joint, refined together: one at a time they creep along a valley of the misfit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import FittedEffect, accept_all_but, refine
from estimation.diagnosis.hypothesis_tests.scoring import accept

ROUNDS = 8
# A round that explains less than this more, in units of chi squared, is the last one.
TOLD = 1.0
# What a round did is done so many times more, as long as that explains more.
FACTORS = (1.0, 2.0, 4.0, 8.0, 16.0)


def refine_shapes_jointly(problem: Problem, members: Sequence[FittedEffect]) -> list[FittedEffect]:
    """Refines the shapes of members that share a joint until they move no more.

    One round refines each beside the others; where all of them went then they go on together (the pattern moves of
    Hooke and Jeeves 1961), for what two formulas have in common one may only give up as the other takes it.
    """
    result = list(members)
    for joint in sorted({m.hypothesis.joint for m in members if m.hypothesis.joint is not None}):
        own = [i for i, m in enumerate(result) if m.hypothesis.joint == joint and m.shape]
        # What acts on all of the torque is measured in sight of the others as they are.
        if len(own) > 1 and not any(result[i].hypothesis.effect.acts_on_total_torque for i in own):
            _along(problem, result, own)
    return result


def _along(problem: Problem, members: list[FittedEffect], own: Sequence[int]) -> None:
    """Moves some of the members, in place."""
    gain = _explained(problem, members)
    for left in reversed(range(ROUNDS)):
        before = [members[i] for i in own]
        for i in own:
            beside = accept_all_but(problem, members, i)
            members[i] = refine(problem, members[i].hypothesis, members[i].shape, beside)
        more = _explained(problem, members) - gain
        # The last word is a refinement's: it says which shapes are free.
        if more < TOLD or not left:
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
    """Gives the shape that goes on as from one to the other, by a multiple of that, within its bounds."""
    effect, joint = after.hypothesis.effect, after.hypothesis.joint
    shape = []
    for (low, high), described, a, b in zip(
        effect.bounds(problem.state_for(effect), joint), effect.shapes, before.shape, after.shape, strict=True
    ):
        further = b * (b / a) ** factor if described.scale == "log" and a > 0 < b else b + factor * (b - a)
        shape.append(float(np.clip(further, low, high)))
    return tuple(shape)
