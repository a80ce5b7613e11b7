"""Comparison of named effects with free functions in their place.

Free functions of position, speed, load and time are flexible. Given enough data they follow any effect, and also the
errors of its formula. A named effect is kept if no free function in its place explains clearly more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from estimation.diagnosis.calibration import (
    FREE_P_VALUE,
    MAX_FREE_FUNCTIONS,
    MIN_BIC_GAIN,
    MIN_EXPLAINED_SHARE,
    MIN_FREE_SHARE,
    MIN_RETAINED_CHI2,
    NEARLY_EXPLAINED_SHARE,
)
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect, is_close_rival
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine
from estimation.diagnosis.hypothesis_tests.scan import Entry, scan
from estimation.diagnosis.hypothesis_tests.scoring import accept
from estimation.diagnosis.searches.selection import SelectedEffect, Selection
from estimation.diagnosis.searches.swap_search import refine_candidates


@dataclass(frozen=True, eq=False)
class ComparedNames:
    """Named effects that are kept, and free functions for the rest of the residual.

    Attributes:
        named: named effects that are kept.
        free_functions: functions that explain the rest, each measured beside those before it; empty if the named
            effects explain enough.
        p_values: p-values of the free functions.
        explained: share of the significant residual that the named effects explain.
    """

    named: tuple[SelectedEffect, ...]
    free_functions: tuple[FittedEffect, ...]
    p_values: tuple[float, ...]
    explained: float


def compare_with_free_functions(
    problem: Problem, selection: Selection, patterns: Sequence[Entry], false_alarm: float
) -> ComparedNames:
    """Keeps the named effects that explain the data about as well as free functions in their place.

    Args:
        problem: whitened data.
        selection: effects selected by the search.
        patterns: all free functions, measured.
        false_alarm: largest p-value of a free function.

    Returns:
        The named effects that are kept, and the free functions for the rest.
    """
    kept = _plausible(problem, selection.found)
    while (worst := _outperformed(problem, kept, patterns, false_alarm)) is not None:
        kept.remove(worst)
    names = [found.effect for found in kept]
    left, p_values = free_functions(problem, patterns, names, false_alarm, alone=True)
    explained = accept(problem, tuple(name.group for name in names)).gain
    total = explained + sum(member.excess_chi2 for member in left)
    share = explained / total if total > 0 else 1.0
    if share >= MIN_EXPLAINED_SHARE:
        return ComparedNames(tuple(kept), (), (), share)
    return ComparedNames(tuple(kept), tuple(left), tuple(p_values), share)


def has_close_rivals(found: SelectedEffect) -> bool:
    """Whether a rival fits about as well. A rare rival must do so without its prior penalty.

    Args:
        found: selected effect with its rivals.
    """
    return any(is_close_rival(rival.hypothesis.effect.rare, worse) for rival, worse in found.rivals)


def _others(kept: Sequence[SelectedEffect], found: SelectedEffect) -> list[FittedEffect]:
    return [other.effect for other in kept if other is not found]


def _outperformed(
    problem: Problem, kept: Sequence[SelectedEffect], patterns: Sequence[Entry], false_alarm: float
) -> SelectedEffect | None:
    """Finds the weakest effect where a free function explains the data better in the place of the named effects.

    The places are each joint, for effects of the whole robot every joint, and for all effects of single joints together
    one cause of the whole robot.
    """
    single = [found for found in kept if found.effect.hypothesis.joint is not None]
    whole = [found for found in kept if found.effect.hypothesis.joint is None]
    places = [
        *(([f for f in single if f.effect.hypothesis.joint == j], (j,)) for j in range(1, problem.n + 1)),
        (whole, (None, *range(1, problem.n + 1))),
        (single, (None,)),
    ]
    for own, joints in places:
        if not own:
            continue
        names, others = [f.effect for f in own], [f.effect for f in kept if f not in own]
        here = [entry for entry in patterns if entry.hypothesis.joint in joints]
        free, _ = free_functions(problem, here, others, false_alarm, most=1)
        if free and not _explain_as_well(problem, names, others, free[0]):
            return min(own, key=lambda f: f.effect.gain)
    return None


def _explain_as_well(
    problem: Problem, names: Sequence[FittedEffect], others: Sequence[FittedEffect], free: FittedEffect
) -> bool:
    """Whether named effects explain the data as well as a free function in their place, beside other effects.

    The function must not have a clearly better BIC. But formulas hold to some per cent only, and a function with more
    parameters follows their errors, too.
    """
    gain = accept(problem, tuple(m.group for m in (*others, *names))).gain
    gain -= accept(problem, tuple(m.group for m in others)).gain
    own = gain - sum(m.gain - m.best_bic_gain for m in names)
    degrees = sum(m.degrees for m in names)
    share = (gain - degrees) / free.excess_chi2 if free.excess_chi2 > 0 else 1.0
    if share < MIN_EXPLAINED_SHARE:
        return False
    flexible = free.degrees > degrees and share >= NEARLY_EXPLAINED_SHARE
    return flexible or free.best_bic_gain <= own + MIN_BIC_GAIN


def _plausible(problem: Problem, founds: Sequence[SelectedEffect]) -> list[SelectedEffect]:
    """Keeps effects and rivals whose parameters are physically plausible."""
    named = [found.effect for found in founds]
    forms = [_plausible_form(problem, found, named) for found in founds]
    return [
        replace(found, rivals=tuple(pair for pair in found.rivals if _is_plausible(problem, pair[0])))
        for found in forms
        if found is not None
    ]


def _plausible_form(problem: Problem, found: SelectedEffect, named: Sequence[FittedEffect]) -> SelectedEffect | None:
    """Returns the effect as fitted if that is plausible, else with usual design values if these fit; None if neither.

    A delay, for example, may be biased if another friction effect acts at reversals, because it delays that one, too.
    """
    own = found.effect
    if _is_plausible(problem, own):
        return found
    effect, joint = own.hypothesis.effect, own.hypothesis.joint
    beside = accept(problem, tuple(m.group for m in named if m is not own))
    for known in effect.likely(problem.state_for(effect), joint, own.shape, own.coefficients):
        shape = tuple(was if value is None else value for value, was in zip(known, own.shape, strict=True))
        member = refine(problem, own.hypothesis, shape, beside, effort=0)
        least = max(MIN_BIC_GAIN, MIN_RETAINED_CHI2 * own.local_bic_gain)
        if _is_plausible(problem, member) and member.local_bic_gain > least:
            return replace(found, effect=member)
    return None


def _is_plausible(problem: Problem, member: FittedEffect) -> bool:
    """Whether the fitted parameters are physically plausible."""
    place, robot = member.hypothesis, problem.situation.robot
    return place.effect.is_plausible(robot, place.joint, member.coefficients, member.shape)


# Number of candidates that are refined. The scan on a grid underrates narrow functions with few parameters.
CONTENDERS = 3


def free_functions(
    problem: Problem,
    patterns: Sequence[Entry],
    named: Sequence[FittedEffect],
    false_alarm: float,
    *,
    alone: bool = False,
    most: int = MAX_FREE_FUNCTIONS,
) -> tuple[list[FittedEffect], list[float]]:
    """Adds free functions beside named effects, as long as the strongest is significant and improves the BIC.

    A free function must also explain a minimum share of what the other effects explain on its joints.

    Args:
        problem: whitened data.
        patterns: candidate free functions, measured.
        named: named effects in the model.
        false_alarm: largest p-value of a free function.
        alone: whether a very small p-value suffices for the first free function if no named effect is in the model.
        most: largest number of free functions.

    Returns:
        The free functions in the order of their selection, and the p-value of each.
    """
    members: list[FittedEffect] = []
    p_values: list[float] = []
    while len(members) < most:
        accepted = accept(problem, tuple(m.group for m in (*named, *members)))
        result = scan(problem, patterns, accepted)
        if not result.outcomes:
            break
        p = result.p_value(result.outcomes[0])
        if not p <= false_alarm:
            break
        near = [o for o in result.outcomes[:CONTENDERS] if o.degrees]
        member = refine_candidates(problem, near, accepted)[0]
        before = (*named, *members)
        if member.excess_chi2 < MIN_FREE_SHARE * sum(m.gain_on(member.group.joints) for m in before):
            break
        if member.bic_gain < MIN_BIC_GAIN and (before or not alone or p > FREE_P_VALUE):
            break
        members.append(member)
        p_values.append(p)
    return members, p_values
