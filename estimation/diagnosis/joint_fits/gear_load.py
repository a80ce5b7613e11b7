"""Whether gears bear the springs, payloads and pushes that were found, and whether that shows another cause."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.calibration import MIN_BIC_GAIN, MIN_GEAR_LOAD
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import FittedEffect, refine, set_bic_gain
from estimation.diagnosis.hypothesis_tests.scoring import accept
from robots.terms.effect_bases.gear_load import ExtraGearLoad, LoadPath, LoadSource
from robots.terms.effects import EFFECTS

Array = NDArray[np.float64]

# What a friction by load may explain that was named otherwise for want of the load.
BY_LOAD = EFFECTS["load_dependent_friction"]


@dataclass(frozen=True, eq=False)
class GearLoad:
    """What gears bear of some effects.

    Attributes:
        extra_load: that; None for nothing.
        improves_fit: whether it explains more than what was found without it, so that a search should be made with it.
    """

    extra_load: ExtraGearLoad | None = None
    improves_fit: bool = False


NO_GEAR_LOAD = GearLoad()


def find_gear_load(problem: Problem, members: Sequence[FittedEffect], values: Array) -> GearLoad:
    """Tells from the data what gears bear of the effects found.

    A gear bears a spring that is mounted behind it, and one is taken to be so where nothing depends on it. Where a load
    that lacks it was felt, the difference was named as something else: so other names on those joints are asked whether
    a friction by load does as much.

    Args:
        problem: what was searched.
        members: the effects.
        values: of base model, nuisance and all members, fitted together.
    """
    at, weights = len(problem.prior.target), []
    for member in members:
        place, own = member.hypothesis, values[at : at + len(member.coefficients)]
        at += len(own)
        if place.effect.loads_gear:
            weights.append(LoadSource(place.effect, place.joint, member.shape, own))
    if not weights:
        return NO_GEAR_LOAD
    ways: list[LoadPath] = ["effects", "preloads"] if any(w.effect.preloads for w in weights) else ["effects"]
    bearings = [ExtraGearLoad(way, weights) for way in ways]
    state = problem.baseline.situation(problem.recording, values[: problem.baseline.base.size])
    extra = bearings[0].on(state).extra_load
    assert extra is not None
    size, other = (np.sqrt(np.mean(torque**2, axis=0)) for torque in (extra, state.load))
    felt = set((np.flatnonzero(size > MIN_GEAR_LOAD * other) + 1).tolist())
    on_them = [m for m in members if m.hypothesis.joint in felt and not m.hypothesis.effect.loads_gear]
    if not on_them:
        return GearLoad(bearings[0])
    before = set_bic_gain(problem, members)
    best, most = GearLoad(bearings[0]), before
    for bearing in bearings:
        now = replace(problem, situation=bearing.on(state), extra_load=bearing)
        for alternative in _alternatives(now, members, on_them):
            worth = set_bic_gain(now, alternative)
            if worth > most + (0.0 if best.improves_fit else MIN_BIC_GAIN):
                best, most = GearLoad(bearing, improves_fit=True), worth
    return best


def _alternatives(
    problem: Problem, members: Sequence[FittedEffect], on_them: Sequence[FittedEffect]
) -> list[list[FittedEffect]]:
    """Lists what the members would be with this load: those that feel it fitted anew, and one name or none left out."""
    feel = [m for m in on_them if m.hypothesis.effect.depends_on_gear_load]
    result = []
    for out in (None, *(m for m in on_them if m not in feel)):
        rest = [m for m in members if m is not out and m not in feel]
        joint = None if out is None else out.hypothesis.joint
        new = [(m.hypothesis, m.shape) for m in feel]
        if joint is not None and not any(place.joint == joint for place, _ in new):
            new.append((Hypothesis(BY_LOAD, joint), BY_LOAD.grid(problem.situation, joint)[0]))
        if new:
            beside = accept(problem, tuple(m.group for m in rest))
            result.append([*rest, *(refine(problem, place, shape, beside) for place, shape in new)])
    return result
