"""Gear load of springs, payloads and contacts that were found, and its influence on load-dependent effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimation.diagnosis.calibration import MIN_BIC_GAIN
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect, set_bic_gain
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine
from estimation.diagnosis.hypothesis_tests.scoring import accept
from robots.common.arrays import Array
from robots.terms.effect_bases.capabilities import GearLoad
from robots.terms.effect_bases.gear_load import ExtraGearLoad, LoadPath, LoadSource
from robots.terms.effects import EFFECTS

# Share of a gear's own load from which another load counts.
MIN_GEAR_LOAD = 0.01
# Effect that may replace another one if the gear load is included.
BY_LOAD = EFFECTS["load_dependent_friction"]


@dataclass(frozen=True, eq=False)
class GearLoadFit:
    """Gear load of the effects found.

    Attributes:
        extra_load: the additional load; None without any.
        improves_fit: whether the effects fit better with this load, so that the search should be repeated.
    """

    extra_load: ExtraGearLoad | None = None
    improves_fit: bool = False


NO_GEAR_LOAD = GearLoadFit()


def find_gear_load(problem: Problem, members: Sequence[FittedEffect], values: Array) -> GearLoadFit:
    """Selects the gear load of the effects found by the BIC.

    Effects with `loads_gear` load the gears by default. A fit without this load may have named another cause for the
    difference. Therefore load-dependent effects are refitted with it, and load-dependent friction may replace one other
    effect.

    Args:
        problem: the searched data and base model.
        members: the effects found.
        values: of base model, nuisance and all effects, fitted together.
    """
    at, weights = len(problem.prior.target), []
    for member in members:
        place, own = member.hypothesis, values[at : at + len(member.coefficients)]
        at += len(own)
        if place.effect.loads_gear:
            weights.append(LoadSource(place.effect, place.joint, member.shape, own))
    if not weights:
        return NO_GEAR_LOAD
    ways: list[LoadPath] = (
        ["effects", "preloads"] if any(w.effect.gear_load is GearLoad.PRELOADS for w in weights) else ["effects"]
    )
    bearings = [ExtraGearLoad(way, weights) for way in ways]
    state = problem.baseline.situation(problem.recording, values[: problem.baseline.base.size])
    extra = bearings[0].on(state).extra_load
    assert extra is not None
    size, other = (np.sqrt(np.mean(torque**2, axis=0)) for torque in (extra, state.load))
    felt = set((np.flatnonzero(size > MIN_GEAR_LOAD * other) + 1).tolist())
    on_them = [m for m in members if m.hypothesis.joint in felt and not m.hypothesis.effect.loads_gear]
    if not on_them:
        return GearLoadFit(bearings[0])
    before = set_bic_gain(problem, members)
    best, most = GearLoadFit(bearings[0]), before
    for bearing in bearings:
        now = replace(problem, situation=bearing.on(state), extra_load=bearing)
        for alternative in _alternatives(now, members, on_them):
            worth = set_bic_gain(now, alternative)
            if worth > most + (0.0 if best.improves_fit else MIN_BIC_GAIN):
                best, most = GearLoadFit(bearing, improves_fit=True), worth
    return best


def _alternatives(
    problem: Problem, members: Sequence[FittedEffect], on_them: Sequence[FittedEffect]
) -> list[list[FittedEffect]]:
    """Lists the effects refitted with this load, with at most one of them left out or replaced."""
    feel = [m for m in on_them if m.hypothesis.effect.gear_load is GearLoad.FEELS]
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
