"""The verdict: is the cause named, are rivals left, or does the catalogue not hold it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimation.diagnosis.patterns import is_of_time
from estimation.diagnosis.problem import Problem
from estimation.diagnosis.refinement import Member, refine
from estimation.diagnosis.scan import Entry, scan
from estimation.diagnosis.scoring import accept, score
from estimation.diagnosis.selection import Found, Selection
from estimation.diagnosis.spotting import Spot

# Named effects that explain less than this share of what stands out of the noise, or of what free functions do in their
# place, do not explain it; nor do those that fit worse than one of those and explain less than the second share of it.
ENOUGH, NEARLY = 0.7, 0.9
# Rivals within this of the best BIC stay possible.
CLOSE = 10.0
MOST_PATTERNS = 3
CONTENDERS = 3
# A name of the whole robot is not owed to a joint where a free function there leaves it this share of its gain.
STAYS = 0.75
# A pattern beside named effects counts when it explains this share of what they do on its joint: formulas are true to
# some per cent.
BEYOND = 0.05
# A pattern is a flexible thing: beside what is named it must be worth its parameters by this much (Schwarz), strong
# evidence, for formulas are not exact. Where nothing is named it must be no more than sure.
LEAST = 10.0
SURE = 1e-9


@dataclass(frozen=True, eq=False)
class Judgement:
    """What the names explain, and what they do not.

    Attributes:
        verdict: ``none``, ``named``, ``ambiguous`` or ``unexplained``.
        kept: the effects whose names hold.
        patterns: functions of the motion that explain the rest, each measured beside all before.
        p_values: of the patterns.
        explained: share of what stands out of the noise that the effects found explain.
    """

    verdict: str
    kept: tuple[Found, ...]
    patterns: tuple[Member, ...]
    p_values: tuple[float, ...]
    explained: float


def judge(
    problem: Problem,
    selection: Selection,
    patterns: Sequence[Entry],
    false_alarm: float,
    rng: np.random.Generator,
) -> Judgement:
    """Weighs the named effects against functions of the motion, joint by joint.

    A name holds where it leaves little that a free function explains, and where free functions in its place do not
    explain much more; several names on one joint must fit better than free functions do, all parameters counted.
    """
    named = [found.member for found in selection.found]
    left, p_values = _patterns(problem, patterns, named, false_alarm, rng, alone=True)
    explained, rest = selection.accepted.gain, sum(map(_worth, left))
    share = explained / (explained + rest) if explained + rest > 0 else 1.0
    kept = tuple(_possible(problem, found) for found in selection.found if _believable(problem, found.member))
    if share < ENOUGH:
        kept = tuple(found for found in kept if found.member.hypothesis.joint is not None)
    kept = tuple(found for found in kept if _holds_alone(problem, found, named, patterns, false_alarm, rng))
    if not _holds_together(problem, named, patterns, false_alarm, rng):
        kept = ()
    joints = {found.member.hypothesis.joint for found in kept} - {None}
    lost = {j for j in joints if not _holds(problem, j, named, patterns, left, false_alarm, rng)}
    # What acts on all joints at once goes before names of single joints that explain less than it does.
    whole = max((_worth(m) for m in left if m.hypothesis.joint is None), default=0.0) if share < ENOUGH else 0.0
    kept = tuple(f for f in kept if f.member.hypothesis.joint not in lost and f.member.gain > whole)
    members = left if share < ENOUGH else []
    while len(kept) < len(named):
        # Names that do not fit would only distort the patterns: those start anew, beside the names that hold.
        beside = [found.member for found in kept]
        members, p_values = _patterns(problem, patterns, beside, false_alarm, rng, alone=True)
        # What is unexplained reaches other joints: names that explain less than it does are not to be trusted.
        strong = tuple(found for found in kept if found.member.gain > max(map(_worth, members), default=0.0))
        if len(strong) == len(kept):
            break
        kept = strong
    while members:
        # A formula may have been named for what is unexplained on all joints, or on another one that it reaches.
        wide = any(member.hypothesis.joint is None for member in members)
        spread = [found for found in kept if wide or len(found.member.group.joints) > 1]
        borrowed = [f for f in spread if not _stays(problem, f, kept, patterns, false_alarm, rng)]
        # So may one that acts on its own joint alone, if base parameters have taken another's torque for it.
        for found in (found for found in kept if found not in spread):
            elsewhere = [member for member in members if member.hypothesis.joint != found.member.hypothesis.joint]
            if not _keep(problem, [found.member], [*_beside(kept, found), *elsewhere]):
                borrowed.append(found)
        if not borrowed:
            return Judgement("unexplained", kept, tuple(members), tuple(p_values), float(share))
        weakest = min(borrowed, key=lambda found: found.member.gain)
        kept = tuple(found for found in kept if found is not weakest)
        beside = [found.member for found in kept]
        members, p_values = _patterns(problem, patterns, beside, false_alarm, rng, alone=True)
    verdict = "none" if not kept else "ambiguous" if any(map(is_open, kept)) else "named"
    return Judgement(verdict, kept, (), (), float(share))


def strongest_pattern(
    problem: Problem,
    patterns: Sequence[Entry],
    named: Sequence[Member],
    false_alarm: float,
    rng: np.random.Generator,
) -> tuple[Member, float] | None:
    """Gives the free function that explains most beside names, and its p-value; None where noise explains as much."""
    members, p_values = _patterns(problem, patterns, named, false_alarm, rng, alone=True)
    return (members[0], p_values[0]) if members else None


def _possible(problem: Problem, found: Found) -> Found:
    """Leaves out rivals that no machine has."""
    rivals = tuple(pair for pair in found.rivals if _believable(problem, pair[0]))
    return found if len(rivals) == len(found.rivals) else replace(found, rivals=rivals)


def _believable(problem: Problem, member: Member) -> bool:
    """Whether a machine may have what was fitted."""
    place, robot = member.hypothesis, problem.situation.robot
    return place.effect.believable(robot, place.joint, member.coefficients, member.shape)


def _holds(
    problem: Problem,
    joint: int | None,
    named: Sequence[Member],
    patterns: Sequence[Entry],
    left: Sequence[Member],
    false_alarm: float,
    rng: np.random.Generator,
) -> bool:
    """Whether the names on a joint explain what is there, beside the names on others."""
    own = [member for member in named if member.hypothesis.joint == joint]
    others = [member for member in named if member.hypothesis.joint != joint]
    gain = accept(problem, tuple(m.group for m in (*others, *own))).gain
    gain -= accept(problem, tuple(m.group for m in others)).gain
    degrees = sum(member.degrees for member in own)
    rest = sum(_worth(member) for member in left if member.hypothesis.joint == joint)
    here = [entry for entry in patterns if entry.hypothesis.joint == joint]
    free, _ = _patterns(problem, here, others, false_alarm, rng)
    if gain - degrees < ENOUGH * max(gain - degrees + rest, sum(map(_worth, free))):
        return False
    if _beaten(problem, gain, degrees, free):
        return False
    if len(own) > 1 and not _thriftier(problem, own, others, free, LEAST):
        return False
    if len(own) == 1 and own[0].hypothesis.effect.waves:
        # Waves over a joint's range are no more than one place of it where that explains nearly as much with less.
        free, _ = _patterns(
            problem, [e for e in here if isinstance(e.hypothesis.effect, Spot)], others, false_alarm, rng
        )
        if free and free[0].degrees < degrees and _worth(free[0]) > NEARLY * (gain - degrees):
            return False
    if any(member.hypothesis.effect.passing for member in own):
        # What comes and goes follows nearly any torque: functions of the motion that do so with less refute it.
        moving = [entry for entry in here if not is_of_time(entry.hypothesis.effect)]
        free, _ = _patterns(problem, moving, others, false_alarm, rng)
        if not _thriftier(problem, own, others, free):
            return False
    whole = [member for member in others if member.hypothesis.joint is None]
    if not whole:
        return True
    # What acts on all joints may have been named for what the name on this one left.
    single = [member for member in others if member.hypothesis.joint is not None]
    free, _ = _patterns(problem, here, single, false_alarm, rng)
    return _keep(problem, whole, [*single, *free]) or _thriftier(problem, [*own, *whole], single, free)


def _holds_alone(
    problem: Problem,
    found: Found,
    named: Sequence[Member],
    patterns: Sequence[Entry],
    false_alarm: float,
    rng: np.random.Generator,
) -> bool:
    """Whether a name of the whole robot explains what free functions would in its place."""
    own = found.member
    if own.hypothesis.joint is not None:
        return True
    others = [member for member in named if member is not own]
    free, _ = _patterns(problem, patterns, others, false_alarm, rng)
    return not _beaten(problem, own.gain, own.degrees, free)


def _holds_together(
    problem: Problem, named: Sequence[Member], patterns: Sequence[Entry], false_alarm: float, rng: np.random.Generator
) -> bool:
    """Whether names fit better than one cause of all joints' torque that no name is for, all parameters counted."""
    whole = [entry for entry in patterns if entry.hypothesis.joint is None]
    free, _ = _patterns(problem, whole, [], false_alarm, rng)
    return _thriftier(problem, named, [], free[:1])


def _beaten(problem: Problem, gain: float, degrees: int, free: Sequence[Member]) -> bool:
    """Whether one free function explains much more than names do, or clearly more and fits better.

    Several of them may be about other things besides, which the names do not claim.
    """
    if not free:
        return False
    most, own = _worth(free[0]), gain - degrees * float(np.log(problem.rows))
    return gain - degrees < ENOUGH * most or (gain - degrees < NEARLY * most and own < _criterion(problem, free[:1]))


def _criterion(problem: Problem, free: Sequence[Member]) -> float:
    """What functions explain together, each beside those before, less what their parameters are worth (Schwarz)."""
    return sum(member.gain - member.degrees * float(np.log(problem.rows)) for member in free)


def _stays(
    problem: Problem,
    found: Found,
    kept: Sequence[Found],
    patterns: Sequence[Entry],
    false_alarm: float,
    rng: np.random.Generator,
) -> bool:
    """Whether a name keeps its gain beside free functions that were chosen without it."""
    others = _beside(kept, found)
    free, _ = _patterns(problem, patterns, others, false_alarm, rng, alone=True)
    return _keep(problem, [found.member], [*others, *free])


def _beside(kept: Sequence[Found], found: Found) -> list[Member]:
    return [other.member for other in kept if other is not found]


def _keep(problem: Problem, names: Sequence[Member], beside: Sequence[Member]) -> bool:
    """Whether names explain beside other functions most of what they do without them."""
    accepted = accept(problem, tuple(member.group for member in beside))
    return all(score(problem, name.group, accepted).gain > STAYS * name.gain for name in names)


def _thriftier(
    problem: Problem, names: Sequence[Member], others: Sequence[Member], free: Sequence[Member], margin: float = 0.0
) -> bool:
    """Whether names fit better than free functions in their place, by a margin (Schwarz), all parameters counted."""
    gain = accept(problem, tuple(m.group for m in (*others, *names))).gain
    gain -= accept(problem, tuple(m.group for m in others)).gain
    price = float(np.log(problem.rows))
    return not free or gain - sum(member.degrees for member in names) * price > _criterion(problem, free) + margin


def _worth(member: Member) -> float:
    return max(member.gain - member.degrees, 0.0)


def is_open(found: Found) -> bool:
    """Whether an effect has rivals that fit about as well; one that robots seldom have does not count alone."""
    return any(worse < CLOSE and not rival.hypothesis.effect.rare for rival, worse in found.rivals)


def _patterns(
    problem: Problem,
    patterns: Sequence[Entry],
    named: Sequence[Member],
    false_alarm: float,
    rng: np.random.Generator,
    *,
    alone: bool = False,
) -> tuple[list[Member], list[float]]:
    """Adds patterns beside named effects, while the strongest is significant and worth it.

    Where the first is `alone`, no formula beside it that could be inexact, it must be no more than sure.
    """
    members: list[Member] = []
    p_values: list[float] = []
    while len(members) < MOST_PATTERNS:
        accepted = accept(problem, tuple(m.group for m in (*named, *members)))
        result = scan(problem, patterns, accepted, rng)
        if not result.outcomes:
            break
        p = result.p_value(result.outcomes[0].evidence)
        if not p <= false_alarm:
            break
        # A grid tells narrow functions of few parameters less well than wide ones of many.
        near = [refine(problem, o.hypothesis, o.shape, accepted) for o in result.outcomes[:CONTENDERS] if o.degrees]
        member = max(near, key=lambda m: m.bic(problem.rows))
        before = (*named, *members)
        if _worth(member) < BEYOND * sum(m.gain_on(member.group.joints) for m in before):
            break
        if member.bic(problem.rows) < LEAST and (before or not alone or p > SURE):
            break
        members.append(member)
        p_values.append(p)
    return members, p_values
