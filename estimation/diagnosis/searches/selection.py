"""Which effects the data ask for: forward steps, each refined before the next, swaps with rivals, backward steps."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import compress

from estimation.diagnosis.calibration import MAX_EFFECTS, MIN_CANDIDATE_GAIN
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import FittedEffect, accept_all_but, refine
from estimation.diagnosis.hypothesis_tests.scan import Entry, Scan, measure, scan
from estimation.diagnosis.hypothesis_tests.scoring import Accepted, accept
from estimation.diagnosis.joint_fits.event_window import refit_event_window
from estimation.diagnosis.joint_fits.total_torque import with_total_torque
from estimation.diagnosis.searches.acceptance import (
    SURE,
    delay_supported_away_from_impacts,
    exceeds_leakage,
    exceeds_single_shock,
    is_accepted,
    is_certain,
)
from estimation.diagnosis.searches.candidate_screening import screen_candidates
from estimation.diagnosis.searches.joint_shape_refinement import refine_shapes_jointly
from estimation.diagnosis.searches.swap_search import refine_candidates, refine_with_swaps, remeasure

FAR_MORE = 1.5  # times the gain


@dataclass(frozen=True, eq=False)
class SelectedEffect:
    """One effect that was selected, and what else could have been.

    Attributes:
        effect: the effect, its shape, measured beside the other effects found.
        p_value: family-wise, of the step that found it.
        rivals: other hypotheses in its place, the closest first, with how much worse their BIC is; none before they
            are asked for (`with_rivals`).
    """

    effect: FittedEffect
    p_value: float
    rivals: tuple[tuple[FittedEffect, float], ...] = ()


@dataclass(frozen=True, eq=False)
class Selection:
    """What was found in one problem.

    Attributes:
        found: the effects, strongest first.
        visible_in_torque: what the torque as logged shows by itself, whatever explains it.
        first: the scan before any was found.
        last: the scan beside all that were found.
        accepted: all found, joined.
        strongest_unaccepted: what stood out of the noise next, but no more than formulas of what was found may leave;
            None for none.
    """

    found: tuple[SelectedEffect, ...]
    visible_in_torque: frozenset[Hypothesis]
    first: Scan
    last: Scan
    accepted: Accepted
    strongest_unaccepted: FittedEffect | None = None


def select(
    problem: Problem,
    entries: Sequence[Entry],
    *,
    false_alarm: float,
    advance: Callable[[str], None] = lambda note: None,
    known: Mapping[Hypothesis, tuple[float, ...]] | None = None,
) -> Selection:
    """Adds effects while the strongest is significant, refining and swapping before each next step.

    Shapes that are `known` from another search are refined from there, too. One that the others make unnecessary once
    they are refined beside it is not tried again, and no set of effects is built on twice: the search would go round in
    a circle.
    """
    members, p_values = _visible_in_torque(problem, entries, false_alarm, ())
    seen = {member.hypothesis for member in members}
    spurned: set[Hypothesis] = set()
    visited = [seen]
    won: dict[Hypothesis, float] = {}
    first: Scan | None = None
    slight: FittedEffect | None = None
    while True:
        accepted = accept(problem, tuple(member.group for member in members))
        result = scan(problem, entries, accepted)
        first = first or result
        if len(members) == MAX_EFFECTS or not result.outcomes:
            break
        chances = {o.hypothesis: result.p_value(o) for o in result.outcomes}
        if not chances[result.outcomes[0].hypothesis] <= false_alarm:
            break
        advance(f"{result.outcomes[0].hypothesis.label}")
        refined = refine_candidates(problem, screen_candidates(problem, result, members), accepted, known)
        chance = {member.hypothesis: chances.get(member.hypothesis, 1.0) for member in refined}
        able = [m for m in refined if chance[m.hypothesis] <= false_alarm and m.hypothesis not in spurned]
        candidates = [m for m in able if is_accepted(problem, m, chance[m.hypothesis], members, false_alarm)]
        candidates = [
            m for m in candidates if not m.hypothesis.effect.transient or exceeds_single_shock(problem, m, accepted)
        ]
        if not candidates:
            break
        # What is sure is on joints where no other acts, and so none leaves anything.
        sure_alone = is_certain(problem, candidates[0], chance[candidates[0].hypothesis], members, false_alarm)
        if not (sure_alone or exceeds_leakage(problem, candidates[0], members)):
            if (formed := _refit_with_candidate(problem, candidates[0], members)) is None:
                slight = candidates[0]
                break
            *members, candidates[0] = formed
            accepted = accept(problem, tuple(member.group for member in members))
        candidates[0] = refit_event_window(problem, candidates[0], accepted)
        members.append(candidates[0])
        p_values.append(chance[candidates[0].hypothesis])
        won[candidates[0].hypothesis] = candidates[0].gain
        # What is known of the torque now may come near what the log shows.
        more, sure = _visible_in_torque(problem, entries, false_alarm, members)
        seen |= {member.hypothesis for member in more}
        members, p_values = [*members, *more], [*p_values, *sure]
        if len(members) > 1:
            members, p_values = refine_with_swaps(problem, entries, members, p_values, seen, won, false_alarm)
            if len({(m.hypothesis.name, m.hypothesis.joint) for m in members}) < len(members):
                break
        # What was found before kicks were known may have been the drives' answers to those.
        held = [
            delay_supported_away_from_impacts(problem, m, [*members[:i], *members[i + 1 :]])
            for i, m in enumerate(members)
        ]
        spurned |= {m.hypothesis for m, own in zip(members, held, strict=True) if not own}
        members, p_values = list(compress(members, held)), list(compress(p_values, held))
        now = {member.hypothesis for member in members}
        if candidates[0].hypothesis not in now:
            spurned.add(candidates[0].hypothesis)
        elif now in visited:
            break
        visited.append(now)
    members = refine_shapes_jointly(problem, members)
    found = [
        SelectedEffect(remeasure(problem, member, accept_all_but(problem, members, i)), p_value)
        for i, (member, p_value) in enumerate(zip(members, p_values, strict=True))
    ]
    kept = [
        f
        for i, f in enumerate(found)
        if f.effect.hypothesis in seen
        or is_accepted(problem, f.effect, f.p_value, [*members[:i], *members[i + 1 :]], false_alarm)
    ]
    order = sorted(kept, key=lambda f: -f.effect.gain)
    last = result if members else first
    joined = accept(problem, tuple(f.effect.group for f in order))
    return Selection(tuple(order), frozenset(seen), first, last, joined, slight)


def with_rivals(problem: Problem, entries: Sequence[Entry], selection: Selection) -> Selection:
    """Measures what else could be in each effect's place, beside the others.

    What was seen in the torque as logged has no rivals, whatever else explains as little of it.
    """
    members = [found.effect for found in selection.found]
    effects = []
    for i, found in enumerate(selection.found):
        rivals: list[tuple[FittedEffect, float]] = []
        if found.effect.hypothesis not in selection.visible_in_torque:
            # It was found by what it is worth: a moment's cause has not all rows to pay for, in sight of others either.
            beside, own = accept_all_but(problem, members, i), found.effect
            reference = max(own.bic_gain, own.local_bic_gain)
            result = scan(problem, entries, beside)
            near = screen_candidates(problem, result, [*members[:i], *members[i + 1 :]], reference)
            rest = [o for o in near if o.hypothesis != found.effect.hypothesis]
            able = [
                rival
                for rival in refine_candidates(problem, rest, beside)
                if rival.gain >= MIN_CANDIDATE_GAIN * found.effect.gain
            ]
            rivals = [(rival, reference - rival.bic_gain) for rival in able]
        effects.append(replace(found, rivals=tuple(rivals)))
    return replace(selection, found=tuple(effects))


def _visible_in_torque(
    problem: Problem,
    entries: Sequence[Entry],
    false_alarm: float,
    members: Sequence[FittedEffect],
) -> tuple[list[FittedEffect], list[float]]:
    """Refines what the torque as logged shows by itself, beside members and each other, with the chance of it.

    That is not a question of what it explains: a torque cut off at a few peaks explains little.
    """
    found: list[FittedEffect] = []
    p_values: list[float] = []
    taken = {member.hypothesis for member in members}
    now = with_total_torque(problem, members, [entry.hypothesis for entry in entries])
    for hypothesis in (entry.hypothesis for entry in entries if entry.hypothesis not in taken):
        state = now.state_for(hypothesis.effect)
        chance = hypothesis.effect.chance(state, hypothesis.joint, problem.recording.tau) * len(entries)
        if chance < SURE * false_alarm:
            beside = accept(problem, tuple(member.group for member in (*members, *found)))
            for outcome in scan(now, measure(now, [hypothesis]), beside).outcomes:
                member = refine(now, hypothesis, outcome.shape, beside) if outcome.degrees else None
                if member is not None and member.gain > 0:
                    # Once more, beside all of the torque as it is when that is known to be so.
                    known = with_total_torque(problem, (*members, *found, member), [hypothesis])
                    found.append(refine(known, hypothesis, member.shape, beside))
                    p_values.append(chance)
    return found, p_values


def _refit_with_candidate(
    problem: Problem, candidate: FittedEffect, members: Sequence[FittedEffect]
) -> list[FittedEffect] | None:
    """Gives members and a candidate refined together, if beside it they take forms that leave it far more; or None.

    A gear that loses less when driven back follows a motor that saturates for most of what that does.
    """
    moved = refine_shapes_jointly(problem, [*members, candidate])
    own = remeasure(problem, moved[-1], accept_all_but(problem, moved, len(members)))
    if own.gain < FAR_MORE * candidate.gain or not exceeds_leakage(problem, own, moved[:-1]):
        return None
    return [*moved[:-1], own]
