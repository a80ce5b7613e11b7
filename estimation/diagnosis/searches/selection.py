"""Stepwise selection of effects: forward steps with refinement, swaps with rivals, backward steps."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from estimation.diagnosis.calibration import MAX_EFFECTS, MIN_CANDIDATE_GAIN
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect, accept_all_but
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine
from estimation.diagnosis.hypothesis_tests.scan import Entry, measure, scan
from estimation.diagnosis.hypothesis_tests.scoring import accept
from estimation.diagnosis.joint_fits.event_window import refit_event_window
from estimation.diagnosis.joint_fits.total_torque import with_total_torque
from estimation.diagnosis.searches.acceptance import (
    SURE,
    exceeds_leakage,
    exceeds_single_shock,
    is_accepted,
    is_certain,
)
from estimation.diagnosis.searches.joint_refinement import refine_shapes_jointly, relinearise
from estimation.diagnosis.searches.swap_search import refine_candidates, refine_with_swaps, remeasure, screen_candidates
from robots.terms.effect_bases.capabilities import Persistence

FAR_MORE = 1.5  # ratio of gains by which a joint refinement must strengthen a candidate


@dataclass(frozen=True, eq=False)
class SelectedEffect:
    """One selected effect and its rivals.

    Attributes:
        effect: effect with its shape, measured beside the other selected effects.
        p_value: family-wise p-value of the step that selected it.
        rivals: other hypotheses in its place, the closest first, and by how much their BIC is worse; empty before
            `with_rivals`.
    """

    effect: FittedEffect
    p_value: float
    rivals: tuple[tuple[FittedEffect, float], ...] = ()


@dataclass(frozen=True, eq=False)
class Selection:
    """Effects selected in one problem.

    Attributes:
        found: selected effects, the strongest first.
        visible_in_torque: effects that the logged torque shows by itself, such as clipping.
        strongest_unaccepted: next significant effect, which formula errors of the selected effects can explain; None
            without one.
    """

    found: tuple[SelectedEffect, ...]
    visible_in_torque: frozenset[Hypothesis]
    strongest_unaccepted: FittedEffect | None = None


def select(
    problem: Problem,
    entries: Sequence[Entry],
    *,
    false_alarm: float,
    advance: Callable[[str], None] = lambda note: None,
    known: Mapping[Hypothesis, tuple[float, ...]] | None = None,
) -> tuple[Problem, Selection]:
    """Adds effects as long as the strongest is significant, with refinement and swaps after each step.

    An effect that is dropped after the others are refined is not tried again. The search stops when a set of effects
    occurs for the second time, because it would not end otherwise.

    Args:
        problem: whitened data.
        entries: hypotheses of the catalogue, measured.
        false_alarm: threshold of the p-values.
        advance: receives the label of the effect in progress.
        known: further starting shapes, from another search.

    Returns:
        The data, with the base model fitted beside the selected effects, and these effects, without rivals.
    """
    members, p_values = _visible_in_torque(problem, entries, false_alarm, ())
    seen = {member.hypothesis for member in members}
    spurned: set[Hypothesis] = set()
    visited = [seen]
    won: dict[Hypothesis, float] = {}
    slight: FittedEffect | None = None
    while True:
        accepted = accept(problem, tuple(member.group for member in members))
        result = scan(problem, entries, accepted)
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
            m
            for m in candidates
            if m.hypothesis.effect.persistence is not Persistence.TRANSIENT
            or exceeds_single_shock(problem, m, accepted)
        ]
        if not candidates:
            break
        # A certain effect acts on joints without other effects, whose formula errors therefore cannot explain it.
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
        problem, members = relinearise(problem, members)
        won[candidates[0].hypothesis] = members[-1].gain
        # With the new effect, more effects may show in the total torque, such as clipping.
        more, sure = _visible_in_torque(problem, entries, false_alarm, members)
        seen |= {member.hypothesis for member in more}
        members, p_values = [*members, *more], [*p_values, *sure]
        if len(members) > 1:
            members, p_values = refine_with_swaps(problem, entries, members, p_values, seen, won, false_alarm)
            if len({(m.hypothesis.name, m.hypothesis.joint) for m in members}) < len(members):
                break
        now = {member.hypothesis for member in members}
        if candidates[0].hypothesis not in now:
            spurned.add(candidates[0].hypothesis)
        elif now in visited:
            break
        visited.append(now)
    if len(members) > 1:
        problem, members = relinearise(problem, refine_shapes_jointly(problem, members))
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
    return problem, Selection(tuple(order), frozenset(seen), slight)


def with_rivals(problem: Problem, entries: Sequence[Entry], selection: Selection) -> Selection:
    """Determines the rivals of each selected effect, measured in its place beside the others.

    Effects that the logged torque shows by itself have no rivals.

    Args:
        problem: whitened data.
        entries: hypotheses of the catalogue, measured.
        selection: selected effects.

    Returns:
        The selection with rivals.
    """
    members = [found.effect for found in selection.found]
    effects = []
    for i, found in enumerate(selection.found):
        rivals: list[tuple[FittedEffect, float]] = []
        if found.effect.hypothesis not in selection.visible_in_torque:
            # A transient effect counts only the rows in which it acts, so its local BIC gain may be the larger one.
            beside, own = accept_all_but(problem, members, i), found.effect
            reference = own.best_bic_gain
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
    """Refines the effects that the logged torque shows by itself, and returns them with their p-values.

    Their gain does not matter, because clipping at a few peaks explains little of the residual.
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
                    # Refines again with the total torque that includes this effect.
                    known = with_total_torque(problem, (*members, *found, member), [hypothesis])
                    found.append(refine(known, hypothesis, member.shape, beside))
                    p_values.append(chance)
    return found, p_values


def _refit_with_candidate(
    problem: Problem, candidate: FittedEffect, members: Sequence[FittedEffect]
) -> list[FittedEffect] | None:
    """Refines members and candidate together; returns them if the candidate's gain grows much, else None.

    Load-dependent friction that is smaller when the gear is driven back, for example, can follow most of a torque
    constant saturation.
    """
    moved = refine_shapes_jointly(problem, [*members, candidate])
    own = remeasure(problem, moved[-1], accept_all_but(problem, moved, len(members)))
    if own.gain < FAR_MORE * candidate.gain or not exceeds_leakage(problem, own, moved[:-1]):
        return None
    return [*moved[:-1], own]
