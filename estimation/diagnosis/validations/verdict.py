"""The verdict: is the cause named, are rivals left, or does the catalogue not hold it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import FittedEffect, refine
from estimation.diagnosis.hypothesis_tests.scan import Entry
from estimation.diagnosis.hypothesis_tests.scoring import accept
from estimation.diagnosis.searches.selection import SelectedEffect, Selection
from estimation.diagnosis.validations.comparison import (
    ENOUGH,
    NEARLY,
    STAYS,
    has_better_bic,
    has_close_rivals,
    is_outperformed,
    retains_gain,
)
from estimation.diagnosis.validations.free_functions import LEAST, excess_chi2, free_functions
from robots.terms.discrepancies.local_fault import LocalFault
from robots.terms.discrepancies.patterns import is_of_time, is_plain

# Several names on a joint that explain this share of what as many free functions do are as good as those.
AS_MUCH = 0.95
# Nor is a name borrowed from free functions of which none does this share of what it does.
HALF = 0.5


@dataclass(frozen=True, eq=False)
class Verdict:
    """What the names explain, and what they do not.

    Attributes:
        verdict: ``none``, ``named``, ``ambiguous`` or ``unexplained``.
        named: the effects whose names hold.
        patterns: functions of the motion that explain the rest, each measured beside all before.
        p_values: of the patterns.
        explained: share of what stands out of the noise that the effects found explain.
    """

    verdict: str
    named: tuple[SelectedEffect, ...]
    patterns: tuple[FittedEffect, ...]
    p_values: tuple[float, ...]
    explained: float


def decide_verdict(
    problem: Problem,
    selection: Selection,
    patterns: Sequence[Entry],
    false_alarm: float,
) -> Verdict:
    """Weighs the named effects against functions of the motion, joint by joint.

    A name holds where it leaves little that a free function explains, and where free functions in its place do not
    explain much more; several names on one joint must fit better than free functions do, all parameters counted.
    """
    named = [found.effect for found in selection.found]
    left, p_values = free_functions(problem, patterns, named, false_alarm, alone=True)
    explained, rest = selection.accepted.gain, sum(map(excess_chi2, left))
    share = explained / (explained + rest) if explained + rest > 0 else 1.0
    able = [_plausible_form(problem, found, named) for found in selection.found]
    named = [member if found is None else found.effect for member, found in zip(named, able, strict=True)]
    kept = tuple(_plausible_rivals(problem, found) for found in able if found is not None)
    if share < ENOUGH:
        kept = tuple(found for found in kept if found.effect.hypothesis.joint is not None)
    kept = tuple(found for found in kept if _outperforms_free_functions(problem, found, named, patterns, false_alarm))
    if not _better_than_one_cause(problem, named, patterns, false_alarm):
        kept = ()
    lost = set()
    for j in sorted({found.effect.hypothesis.joint for found in kept if found.effect.hypothesis.joint is not None}):
        if _explains_joint(problem, j, named, patterns, left, false_alarm):
            continue
        if (fewer := _drop_weakest(problem, j, named, patterns, false_alarm)) is None:
            lost.add(j)
        else:
            named = fewer
            again = {member.hypothesis: member for member in named}
            kept = tuple(replace(f, effect=again[f.effect.hypothesis]) for f in kept if f.effect.hypothesis in again)
    # What acts on all joints at once goes before names of single joints that explain less than it does.
    whole = max((excess_chi2(m) for m in left if m.hypothesis.joint is None), default=0.0) if share < ENOUGH else 0.0
    kept = tuple(f for f in kept if f.effect.hypothesis.joint not in lost and f.effect.gain > whole)
    members = left if share < ENOUGH else []
    while len(kept) < len(named):
        # Names that do not fit would only distort the patterns: those start anew, beside the names that hold.
        beside = [found.effect for found in kept]
        members, p_values = free_functions(problem, patterns, beside, false_alarm, alone=True)
        # What is unexplained reaches other joints: names that explain less than it does are not to be trusted.
        strong = tuple(found for found in kept if found.effect.gain > max(map(excess_chi2, members), default=0.0))
        if len(strong) == len(kept):
            break
        kept = strong
    while members:
        # A formula may have been named for what is unexplained on all joints, or on another one that it reaches.
        wide = any(member.hypothesis.joint is None for member in members)
        spread = [found for found in kept if wide or len(found.effect.group.joints) > 1]
        borrowed = [f for f in spread if not _is_robust(problem, f, kept, patterns, false_alarm)]
        # So may one that acts on its own joint alone, if base parameters have taken another's torque for it.
        for found in (found for found in kept if found not in spread):
            elsewhere = [member for member in members if member.hypothesis.joint != found.effect.hypothesis.joint]
            if not retains_gain(problem, [found.effect], [*_others(kept, found), *elsewhere]):
                borrowed.append(found)
        if not borrowed:
            return Verdict("unexplained", kept, tuple(members), tuple(p_values), float(share))
        weakest = min(borrowed, key=lambda found: found.effect.gain)
        kept = tuple(found for found in kept if found is not weakest)
        beside = [found.effect for found in kept]
        members, p_values = free_functions(problem, patterns, beside, false_alarm, alone=True)
    verdict = "none" if not kept else "ambiguous" if any(map(has_close_rivals, kept)) else "named"
    return Verdict(verdict, kept, (), (), float(share))


def _plausible_rivals(problem: Problem, found: SelectedEffect) -> SelectedEffect:
    """Leaves out rivals that no machine has."""
    rivals = tuple(pair for pair in found.rivals if _is_plausible(problem, pair[0]))
    return found if len(rivals) == len(found.rivals) else replace(found, rivals=rivals)


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
        if _is_plausible(problem, member) and member.local_bic_gain(problem.rows) > max(
            LEAST, STAYS * own.local_bic_gain(problem.rows)
        ):
            return replace(found, effect=member)
    return None


def _is_plausible(problem: Problem, member: FittedEffect) -> bool:
    """Whether a machine may have what was fitted."""
    place, robot = member.hypothesis, problem.situation.robot
    return place.effect.is_plausible(robot, place.joint, member.coefficients, member.shape)


def _explains_joint(
    problem: Problem,
    joint: int | None,
    named: Sequence[FittedEffect],
    patterns: Sequence[Entry],
    left: Sequence[FittedEffect],
    false_alarm: float,
) -> bool:
    """Whether the names on a joint explain what is there, beside the names on others."""
    own = [member for member in named if member.hypothesis.joint == joint]
    others = [member for member in named if member.hypothesis.joint != joint]
    gain = accept(problem, tuple(m.group for m in (*others, *own))).gain
    gain -= accept(problem, tuple(m.group for m in others)).gain
    degrees = sum(member.degrees for member in own)
    rest = sum(excess_chi2(member) for member in left if member.hypothesis.joint == joint)
    here = [entry for entry in patterns if entry.hypothesis.joint == joint]
    free, _ = free_functions(problem, here, others, false_alarm)
    if gain - degrees < ENOUGH * max(gain - degrees + rest, sum(map(excess_chi2, free))):
        return False
    if is_outperformed(problem, gain, degrees, free):
        return False
    # Free functions that are as many as the names claim as many causes, and have more freedom to follow each.
    as_many = len(free) >= len(own) and gain - degrees > AS_MUCH * sum(map(excess_chi2, free))
    if len(own) > 1 and not as_many and not has_better_bic(problem, own, others, free, LEAST):
        return False
    if len(own) == 1:
        # Waves over a joint's range are no more than one place of it where that explains nearly as much with less.
        waves = own[0].hypothesis.effect.oscillates_over_range
        spots = [entry for entry in here if waves and isinstance(entry.hypothesis.effect, LocalFault)]
        free = free_functions(problem, spots, others, false_alarm)[0] if spots else []
        if free and free[0].degrees < degrees and excess_chi2(free[0]) > NEARLY * (gain - degrees):
            return False
        # Nor is anything what another place, or a position that counts less and less, explains more of, and better.
        plain = [entry for entry in here if is_plain(entry.hypothesis.effect)]
        free, _ = free_functions(problem, plain, others, false_alarm)
        if (
            free
            and excess_chi2(free[0]) > gain - degrees + LEAST
            and not has_better_bic(problem, own, others, free[:1])
        ):
            return False
    if any(member.hypothesis.effect.transient for member in own):
        # What comes and goes follows nearly any torque: functions of the motion that do so with less refute it.
        moving = [entry for entry in here if not is_of_time(entry.hypothesis.effect)]
        free, _ = free_functions(problem, moving, others, false_alarm)
        if not has_better_bic(problem, own, others, free):
            return False
    whole = [member for member in others if member.hypothesis.joint is None]
    if not whole:
        return True
    # What acts on all joints may have been named for what the name on this one left.
    single = [member for member in others if member.hypothesis.joint is not None]
    free, _ = free_functions(problem, here, single, false_alarm)
    return retains_gain(problem, whole, [*single, *free]) or has_better_bic(problem, [*own, *whole], single, free)


def _drop_weakest(
    problem: Problem,
    joint: int,
    named: Sequence[FittedEffect],
    patterns: Sequence[Entry],
    false_alarm: float,
) -> list[FittedEffect] | None:
    """Leaves out the weakest of several names on a joint, as many as it takes for the others to hold; None if none do.

    What the formula of one leaves, or that of another beside it, small names are found for.
    """
    own = sorted((m for m in named if m.hypothesis.joint == joint), key=lambda m: -m.gain)
    rest = [m for m in named if m.hypothesis.joint != joint]
    here = [entry for entry in patterns if entry.hypothesis.joint == joint]
    while len(own) > 1:
        own = own[:-1]
        for i, member in enumerate(own):
            beside = accept(problem, tuple(m.group for m in (*rest, *own[:i], *own[i + 1 :])))
            own[i] = refine(problem, member.hypothesis, member.shape, beside)
        left, _ = free_functions(problem, here, [*rest, *own], false_alarm, alone=True)
        if _explains_joint(problem, joint, [*rest, *own], patterns, left, false_alarm):
            return [*rest, *own]
    return None


def _outperforms_free_functions(
    problem: Problem,
    found: SelectedEffect,
    named: Sequence[FittedEffect],
    patterns: Sequence[Entry],
    false_alarm: float,
) -> bool:
    """Whether a name of the whole robot explains what free functions would in its place."""
    own = found.effect
    if own.hypothesis.joint is not None:
        return True
    others = [member for member in named if member is not own]
    free, _ = free_functions(problem, patterns, others, false_alarm)
    if is_outperformed(problem, own.gain, own.degrees, free):
        return False
    plain = [entry for entry in patterns if is_plain(entry.hypothesis.effect) and entry.hypothesis.joint is None]
    free = free_functions(problem, plain, others, false_alarm)[0] if plain else []
    return not free or excess_chi2(free[0]) <= own.gain - own.degrees + LEAST


def _better_than_one_cause(
    problem: Problem,
    named: Sequence[FittedEffect],
    patterns: Sequence[Entry],
    false_alarm: float,
) -> bool:
    """Whether names fit better than one cause of all joints' torque that no name is for, all parameters counted."""
    whole = [entry for entry in patterns if entry.hypothesis.joint is None]
    free, _ = free_functions(problem, whole, [], false_alarm)
    single = all(member.hypothesis.joint is not None for member in named)
    reached = {j for member in named for j in member.group.joints}
    # On the names' joints alone, a cause of all joints explains no more than they do, and is rarer in machines.
    here = single and bool(free) and free[0].gain - free[0].gain_on(sorted(reached)) < LEAST
    return has_better_bic(problem, named, [], free[:1], -LEAST if here else 0.0)


def _is_robust(
    problem: Problem,
    found: SelectedEffect,
    kept: Sequence[SelectedEffect],
    patterns: Sequence[Entry],
    false_alarm: float,
) -> bool:
    """Whether a name keeps its gain beside free functions that were chosen without it, or does more than they do.

    Flexible functions, each on a joint, imitate much of what acts on all: there are many of them then, none of which
    does half of what the name does. A name that borrows does so from one.
    """
    others = _others(kept, found)
    free, _ = free_functions(problem, patterns, others, false_alarm, alone=True)
    own = found.effect
    each = [excess_chi2(member) / max(excess_chi2(own), 1e-300) for member in free]
    if sum(each) < NEARLY and max(each, default=0.0) < HALF and has_better_bic(problem, [own], others, free):
        return True
    return retains_gain(problem, [own], [*others, *free])


def _others(kept: Sequence[SelectedEffect], found: SelectedEffect) -> list[FittedEffect]:
    return [other.effect for other in kept if other is not found]
