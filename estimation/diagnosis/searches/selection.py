"""Which effects the data ask for: forward steps, each refined before the next, swaps with rivals, backward steps."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import compress

import numpy as np

from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import Member, all_but, refine
from estimation.diagnosis.hypothesis_tests.scan import Entry, Scan, measure, scan
from estimation.diagnosis.hypothesis_tests.scoring import Accepted, accept
from estimation.diagnosis.joint_fits.event_window import as_it_lasts
from estimation.diagnosis.joint_fits.total_torque import composed
from estimation.diagnosis.searches.acceptance import SURE, beyond, is_sure, is_told, lasts, told_aside
from estimation.diagnosis.searches.candidate_screening import NEAR, contenders
from estimation.diagnosis.searches.joint_shape_refinement import together
from estimation.diagnosis.searches.swap_search import best, measured, polished

MOST = 4  # effects at once
FAR_MORE = 1.5  # times the gain
SHOWN = 40  # outcomes whose p-values are computed


@dataclass(frozen=True, eq=False)
class Found:
    """One effect that was selected, and what else could have been.

    Attributes:
        member: the effect, its shape, measured beside the other effects found.
        p_value: family-wise, of the step that found it.
        rivals: other hypotheses in its place, the closest first, with how much worse their BIC is; none before they
            are asked for (`with_rivals`).
    """

    member: Member
    p_value: float
    rivals: tuple[tuple[Member, float], ...] = ()


@dataclass(frozen=True, eq=False)
class Selection:
    """What was found in one problem.

    Attributes:
        found: the effects, strongest first.
        seen: what the torque as logged shows by itself, whatever explains it.
        first: the scan before any was found.
        last: the scan beside all that were found.
        accepted: all found, joined.
        slight: what stood out of the noise next, but no more than formulas of what was found may leave; None for none.
    """

    found: tuple[Found, ...]
    seen: frozenset[Hypothesis]
    first: Scan
    last: Scan
    accepted: Accepted
    slight: Member | None = None


def select(
    problem: Problem,
    entries: Sequence[Entry],
    *,
    false_alarm: float,
    rng: np.random.Generator,
    advance: Callable[[str], None] = lambda note: None,
    known: Mapping[Hypothesis, tuple[float, ...]] | None = None,
) -> Selection:
    """Adds effects while the strongest is significant, refining and swapping before each next step.

    Shapes that are `known` from another search are refined from there, too. One that the others make unnecessary once
    they are refined beside it is not tried again, and no set of effects is built on twice: the search would go round in
    a circle.
    """
    members, p_values = _seen(problem, entries, false_alarm, rng, ())
    seen = {member.hypothesis for member in members}
    spurned: set[Hypothesis] = set()
    visited = [seen]
    won: dict[Hypothesis, float] = {}
    first: Scan | None = None
    slight: Member | None = None
    while True:
        accepted = accept(problem, tuple(member.group for member in members))
        result = scan(problem, entries, accepted, rng)
        first = first or result
        if len(members) == MOST or not result.outcomes:
            break
        chances = {o.hypothesis: result.p_value(o.evidence) for o in result.outcomes[:SHOWN]}
        if not chances[result.outcomes[0].hypothesis] <= false_alarm:
            break
        advance(f"{result.outcomes[0].hypothesis.label}")
        refined = best(problem, contenders(problem, result, members), accepted, known)
        chance = {member.hypothesis: chances.get(member.hypothesis, 1.0) for member in refined}
        able = [m for m in refined if chance[m.hypothesis] <= false_alarm and m.hypothesis not in spurned]
        told = [m for m in able if is_told(problem, m, chance[m.hypothesis], members, false_alarm)]
        told = [m for m in told if not m.hypothesis.effect.passing or lasts(problem, m, accepted)]
        if not told:
            break
        # What is sure is on joints where no other acts, and so none leaves anything.
        sure_alone = is_sure(problem, told[0], chance[told[0].hypothesis], members, false_alarm)
        if not (sure_alone or beyond(problem, told[0], members)):
            if (formed := _formed_anew(problem, told[0], members)) is None:
                slight = told[0]
                break
            *members, told[0] = formed
            accepted = accept(problem, tuple(member.group for member in members))
        told[0] = as_it_lasts(problem, told[0], accepted)
        members.append(told[0])
        p_values.append(chance[told[0].hypothesis])
        won[told[0].hypothesis] = told[0].gain
        # What is known of the torque now may come near what the log shows.
        more, sure = _seen(problem, entries, false_alarm, rng, members)
        seen |= {member.hypothesis for member in more}
        members, p_values = [*members, *more], [*p_values, *sure]
        if len(members) > 1:
            members, p_values = polished(problem, entries, members, p_values, seen, won, rng, false_alarm)
            if len({(m.hypothesis.name, m.hypothesis.joint) for m in members}) < len(members):
                break
        # What was found before kicks were known may have been the drives' answers to those.
        held = [told_aside(problem, m, [*members[:i], *members[i + 1 :]]) for i, m in enumerate(members)]
        spurned |= {m.hypothesis for m, own in zip(members, held, strict=True) if not own}
        members, p_values = list(compress(members, held)), list(compress(p_values, held))
        now = {member.hypothesis for member in members}
        if told[0].hypothesis not in now:
            spurned.add(told[0].hypothesis)
        elif now in visited:
            break
        visited.append(now)
    members = together(problem, members)
    found = [
        Found(measured(problem, member, all_but(problem, members, i)), p_value)
        for i, (member, p_value) in enumerate(zip(members, p_values, strict=True))
    ]
    kept = [
        f
        for i, f in enumerate(found)
        if f.member.hypothesis in seen
        or is_told(problem, f.member, f.p_value, [*members[:i], *members[i + 1 :]], false_alarm)
    ]
    order = sorted(kept, key=lambda f: -f.member.gain)
    last = result if members else first
    joined = accept(problem, tuple(f.member.group for f in order))
    return Selection(tuple(order), frozenset(seen), first, last, joined, slight)


def with_rivals(
    problem: Problem, entries: Sequence[Entry], selection: Selection, rng: np.random.Generator
) -> Selection:
    """Measures what else could be in each effect's place, beside the others.

    What was seen in the torque as logged has no rivals, whatever else explains as little of it.
    """
    members = [found.member for found in selection.found]
    told = []
    for i, found in enumerate(selection.found):
        rivals: list[tuple[Member, float]] = []
        if found.member.hypothesis not in selection.seen:
            # It was found by what it is worth: a moment's cause has not all rows to pay for, in sight of others either.
            beside, own = all_but(problem, members, i), found.member
            reference = max(own.bic(problem.rows), own.worth(problem.rows))
            result = scan(problem, entries, beside, rng, nulls=False)
            near = contenders(problem, result, [*members[:i], *members[i + 1 :]], reference)
            rest = [o for o in near if o.hypothesis != found.member.hypothesis]
            able = [rival for rival in best(problem, rest, beside) if rival.gain >= NEAR * found.member.gain]
            rivals = [(rival, reference - rival.bic(problem.rows)) for rival in able]
        told.append(replace(found, rivals=tuple(rivals)))
    return replace(selection, found=tuple(told))


def _seen(
    problem: Problem, entries: Sequence[Entry], false_alarm: float, rng: np.random.Generator, members: Sequence[Member]
) -> tuple[list[Member], list[float]]:
    """Refines what the torque as logged shows by itself, beside members and each other, with the chance of it.

    That is not a question of what it explains: a torque cut off at a few peaks explains little.
    """
    found: list[Member] = []
    p_values: list[float] = []
    taken = {member.hypothesis for member in members}
    now = composed(problem, members, [entry.hypothesis for entry in entries])
    for hypothesis in (entry.hypothesis for entry in entries if entry.hypothesis not in taken):
        state = now.sees(hypothesis.effect)
        chance = hypothesis.effect.chance(state, hypothesis.joint, problem.recording.tau) * len(entries)
        if chance < SURE * false_alarm:
            beside = accept(problem, tuple(member.group for member in (*members, *found)))
            for outcome in scan(now, measure(now, [hypothesis]), beside, rng, nulls=False).outcomes:
                member = refine(now, hypothesis, outcome.shape, beside) if outcome.degrees else None
                if member is not None and member.gain > 0:
                    # Once more, beside all of the torque as it is when that is known to be so.
                    known = composed(problem, (*members, *found, member), [hypothesis])
                    found.append(refine(known, hypothesis, member.shape, beside))
                    p_values.append(chance)
    return found, p_values


def _formed_anew(problem: Problem, candidate: Member, members: Sequence[Member]) -> list[Member] | None:
    """Gives members and a candidate refined together, if beside it they take forms that leave it far more; or None.

    A gear that loses less when driven back follows a motor that saturates for most of what that does.
    """
    moved = together(problem, [*members, candidate])
    own = measured(problem, moved[-1], all_but(problem, moved, len(members)))
    if own.gain < FAR_MORE * candidate.gain or not beyond(problem, own, moved[:-1]):
        return None
    return [*moved[:-1], own]
