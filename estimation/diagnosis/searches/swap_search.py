"""Effects that are found refined beside each other: each against what else could be in its place, or none."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from estimation.diagnosis.calibration import MIN_BIC_GAIN
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import (
    FittedEffect,
    accept_all_but,
    refine,
    set_bic_gain,
)
from estimation.diagnosis.hypothesis_tests.scan import Entry, Outcome, scan
from estimation.diagnosis.hypothesis_tests.scoring import Accepted, score
from estimation.diagnosis.joint_fits.total_torque import with_total_torque
from estimation.diagnosis.searches.acceptance import is_certain
from estimation.diagnosis.searches.candidate_screening import screen_candidates
from robots.common.parallel import threaded

# A member whose gain is within this share of what it was when it won over its rivals wins over them still.
SAME = 0.02
RIVALS = 4  # that are tried in a member's place at once


def refine_with_swaps(
    problem: Problem,
    entries: Sequence[Entry],
    members: list[FittedEffect],
    p_values: list[float],
    seen: Collection[Hypothesis],
    won: dict[Hypothesis, float],
    false_alarm: float,
) -> tuple[list[FittedEffect], list[float]]:
    """Refines each member beside the others, lets its rivals take its place, and drops what is no longer needed.

    What was seen in the torque stays. Rivals of one that has `won` over them with the gain that it has still, whatever
    is beside it now, are not tried again, but those that act on joints of the newest as well, where it does not: that
    may have hidden there what they explain. Such a one is tried with the others refined beside it, too.
    """
    newest = set(members[-1].group.joints)
    for _ in range(2):
        changed = False
        for i in range(len(members)):
            others = [m for k, m in enumerate(members) if k != i]
            beside = accept_all_but(problem, members, i)
            now = with_total_torque(problem, members, [members[i].hypothesis])
            reached = remeasure(problem, members[i], beside)
            before = won.get(members[i].hypothesis)
            still = before is not None and abs(reached.gain - before) <= SAME * before
            cleared = newest.difference(members[i].group.joints)
            if (still and not cleared) or members[i].hypothesis in seen:
                members[i] = refine(now, members[i].hypothesis, members[i].shape, beside)
                continue
            result = scan(problem, entries, beside)
            near = screen_candidates(problem, result, others, reached.bic_gain)
            rest = [o for o in near if o.hypothesis != members[i].hypothesis]
            if still:
                rest = [o for o in rest if cleared.intersection(_acts_on(problem, o.hypothesis))]
            # All at once: the refinement of its own shape takes as long as those of its rivals.
            with ThreadPoolExecutor(1) as apart:
                own = apart.submit(refine, now, members[i].hypothesis, members[i].shape, beside)
                rivals = refine_candidates(problem, rest[:RIVALS], beside)
            first = max([own.result(), *rivals], key=lambda m: m.bic_gain)
            was, members[i] = members[i].hypothesis, first
            if first.hypothesis == was:
                wide = [rival for rival in rivals if cleared.intersection(rival.group.joints)]
                members = _with(problem, members, i, wide[0], seen) if wide else members
            changed |= members[i].hypothesis != was
            won[members[i].hypothesis] = members[i].gain
        if not changed:
            break
    keep = [
        i
        for i, m in enumerate(members)
        if m.hypothesis in seen
        or _again(problem, members, i).local_bic_gain > MIN_BIC_GAIN
        or is_certain(problem, m, p_values[i], [*members[:i], *members[i + 1 :]], false_alarm)
    ]
    return [members[i] for i in keep], [p_values[i] for i in keep]


def _again(problem: Problem, members: Sequence[FittedEffect], i: int) -> FittedEffect:
    """Gives a member, measured anew beside the others as they are now if it was worth too little beside what they were.

    Joints on which they had not found their forms yet may have seemed at odds.
    """
    m = members[i]
    if m.local_bic_gain > MIN_BIC_GAIN:
        return m
    now = refine(problem, m.hypothesis, m.shape, accept_all_but(problem, members, i), effort=0)
    return replace(m, gain=now.gain, birge_ratio=now.birge_ratio, motion_error_chi2=now.motion_error_chi2)


def _with(
    problem: Problem, members: list[FittedEffect], i: int, rival: FittedEffect, seen: Collection[Hypothesis]
) -> list[FittedEffect]:
    """Gives members with a rival in the place of one and the others on its joints refined beside it, if that is better.

    A ripple that has taken up how late its torque is leaves a delay of all torque nothing there.
    """
    trial = [*members[:i], rival, *members[i + 1 :]]
    for k, m in enumerate(members):
        if k != i and m.hypothesis not in seen and set(m.group.joints).intersection(rival.group.joints):
            trial[k] = refine(
                with_total_torque(problem, trial, [m.hypothesis]),
                m.hypothesis,
                m.shape,
                accept_all_but(problem, trial, k),
            )
    trial[i] = refine(problem, rival.hypothesis, rival.shape, accept_all_but(problem, trial, i))
    return max(members, trial, key=lambda some: set_bic_gain(problem, some))


def refine_candidates(
    problem: Problem,
    outcomes: Sequence[Outcome],
    accepted: Accepted,
    known: Mapping[Hypothesis, tuple[float, ...]] | None = None,
) -> list[FittedEffect]:
    """Refines contenders, from shapes that are known too, the best BIC first."""
    starts = [(o.hypothesis, o.shape) for o in outcomes]
    starts += [(o.hypothesis, known[o.hypothesis]) for o in outcomes if known and o.hypothesis in known]
    refined = threaded(lambda start: refine(problem, start[0], start[1], accepted), starts)
    tops: dict[Hypothesis, FittedEffect] = {}
    for member in sorted(refined, key=lambda member: -member.bic_gain):
        tops.setdefault(member.hypothesis, member)
    return list(tops.values())


def remeasure(problem: Problem, member: FittedEffect, beside: Accepted) -> FittedEffect:
    """Measures a member anew, at its shape, beside what is accepted."""
    result = score(problem, member.group, beside)
    bounds = member.hypothesis.coefficient_bounds(problem.situation.robot, member.shape)
    gain, coefficients = result.bounded(*bounds)
    return replace(member, gain=gain, coefficients=coefficients, visible=result.visible)


def _acts_on(problem: Problem, hypothesis: Hypothesis) -> tuple[int, ...]:
    return hypothesis.effect.acts_on(problem.situation.robot, hypothesis.joint)
