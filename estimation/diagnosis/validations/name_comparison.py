"""Named effects against free functions: does a cause explain the data as well as a function without a name?

Functions of position, speed, load and time are flexible: given enough data they follow any effect, and any error of its
formula too. A name stands where no free function in its place explains clearly more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from estimation.diagnosis.calibration import (
    CLOSE_RIVAL_BIC,
    MIN_BIC_GAIN,
    MIN_EXPLAINED_SHARE,
    MIN_RETAINED_CHI2,
    NEARLY_EXPLAINED_SHARE,
    RARE_ODDS,
)
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import FittedEffect, refine, set_bic_gain
from estimation.diagnosis.hypothesis_tests.scan import Entry
from estimation.diagnosis.hypothesis_tests.scoring import accept, score
from estimation.diagnosis.searches.selection import SelectedEffect, Selection
from estimation.diagnosis.validations.free_functions import free_functions


@dataclass(frozen=True, eq=False)
class ComparedNames:
    """What the names explain, and what they do not.

    Attributes:
        named: the effects whose names stand.
        free_functions: functions of the motion that explain the rest, each measured beside all before.
        p_values: of the free functions.
        explained: share of the significant residual that the effects found explain.
    """

    named: tuple[SelectedEffect, ...]
    free_functions: tuple[FittedEffect, ...]
    p_values: tuple[float, ...]
    explained: float


def compare_with_free_functions(
    problem: Problem, selection: Selection, patterns: Sequence[Entry], false_alarm: float
) -> ComparedNames:
    """Keeps the names that explain the data as well as free functions in their place.

    Args:
        problem: the whitened data.
        selection: the effects found.
        patterns: all free functions, measured.
        false_alarm: chance of one.
    """
    found = [found.effect for found in selection.found]
    left, p_values = free_functions(problem, patterns, found, false_alarm, alone=True)
    share = _share(selection.accepted.gain, left)
    kept = _plausible(problem, selection.found)
    while (worst := _outperformed(problem, kept, patterns, false_alarm)) is not None:
        kept.remove(worst)
    if len(kept) < len(found):
        left, p_values = free_functions(problem, patterns, [f.effect for f in kept], false_alarm, alone=True)
    while _share(accept(problem, tuple(f.effect.group for f in kept)).gain, left) < MIN_EXPLAINED_SHARE:
        # A formula may have been named for part of what is unexplained, which reaches other joints.
        borrowed = [f for f in kept if not _retains_gain(problem, f.effect, [*_others(kept, f), *left])]
        if not borrowed:
            return ComparedNames(tuple(kept), tuple(left), tuple(p_values), share)
        kept.remove(min(borrowed, key=lambda f: f.effect.gain))
        left, p_values = free_functions(problem, patterns, [f.effect for f in kept], false_alarm, alone=True)
    return ComparedNames(tuple(kept), (), (), share)


def has_close_rivals(found: SelectedEffect) -> bool:
    """Whether another cause fits about as well; a rare one must do so by the data alone."""
    return any(
        worse < (RARE_ODDS if rival.hypothesis.effect.rare else CLOSE_RIVAL_BIC) for rival, worse in found.rivals
    )


def _share(explained: float, left: Sequence[FittedEffect]) -> float:
    """Share of the significant residual that is explained, if these functions explain the rest."""
    total = explained + sum(member.excess_chi2 for member in left)
    return explained / total if total > 0 else 1.0


def _others(kept: Sequence[SelectedEffect], found: SelectedEffect) -> list[FittedEffect]:
    return [other.effect for other in kept if other is not found]


def _outperformed(
    problem: Problem, kept: Sequence[SelectedEffect], patterns: Sequence[Entry], false_alarm: float
) -> SelectedEffect | None:
    """Finds the weakest name of a joint, or of the whole robot, where a free function explains clearly more."""
    for joint in sorted({found.effect.hypothesis.joint or 0 for found in kept}):
        own = [found for found in kept if (found.effect.hypothesis.joint or 0) == joint]
        names, others = [f.effect for f in own], [f.effect for f in kept if f not in own]
        here = [entry for entry in patterns if joint in (0, entry.hypothesis.joint)]
        free, _ = free_functions(problem, here, others, false_alarm)
        if not free:
            continue
        gain = accept(problem, tuple(m.group for m in (*others, *names))).gain
        gain -= accept(problem, tuple(m.group for m in others)).gain
        excess, most = gain - sum(m.degrees for m in names), free[0].excess_chi2
        # Formulas are true to some per cent, and functions follow their errors as well.
        nearly = excess >= NEARLY_EXPLAINED_SHARE * most or set_bic_gain(problem, names, others) >= free[0].bic_gain
        if excess < MIN_EXPLAINED_SHARE * most or not nearly:
            return min(own, key=lambda f: f.effect.gain)
    return None


def _retains_gain(problem: Problem, name: FittedEffect, beside: Sequence[FittedEffect]) -> bool:
    """Whether a name explains beside other functions most of what it does without them."""
    accepted = accept(problem, tuple(member.group for member in beside))
    return score(problem, name.group, accepted).gain > MIN_RETAINED_CHI2 * name.gain


def _plausible(problem: Problem, founds: Sequence[SelectedEffect]) -> list[SelectedEffect]:
    """Keeps effects and rivals whose parameters a machine may have."""
    named = [found.effect for found in founds]
    forms = [_plausible_form(problem, found, named) for found in founds]
    return [
        replace(found, rivals=tuple(pair for pair in found.rivals if _is_plausible(problem, pair[0])))
        for found in forms
        if found is not None
    ]


def _plausible_form(problem: Problem, found: SelectedEffect, named: Sequence[FittedEffect]) -> SelectedEffect | None:
    """Gives what was found as a machine may have it: as fitted, or in a likely form that is worth it; None if neither.

    A delay may be biased where another friction effect acts at reversals: it delays that one, too.
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
    """Whether a machine may have what was fitted."""
    place, robot = member.hypothesis, problem.situation.robot
    return place.effect.is_plausible(robot, place.joint, member.coefficients, member.shape)
