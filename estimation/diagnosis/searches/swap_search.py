"""Refinement of candidates and of selected effects; a selected effect may be replaced by a rival, or dropped."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from estimation.diagnosis.calibration import MIN_BIC_GAIN, MIN_CANDIDATE_GAIN
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect, accept_all_but, set_bic_gain
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine
from estimation.diagnosis.hypothesis_tests.scan import Entry, Outcome, Scan, scan
from estimation.diagnosis.hypothesis_tests.scoring import Accepted, score
from estimation.diagnosis.joint_fits.total_torque import with_total_torque
from estimation.diagnosis.searches.acceptance import is_certain
from robots.common.forks import forked
from robots.terms.effect_bases.capabilities import Persistence
from robots.terms.effects import Effect

# Relative change of a member's gain up to which its last comparison with rivals remains valid.
SAME = 0.02
RIVALS = 4  # largest number of rivals that are refined in a member's place


def refine_with_swaps(
    problem: Problem,
    entries: Sequence[Entry],
    members: list[FittedEffect],
    p_values: list[float],
    seen: Collection[Hypothesis],
    won: dict[Hypothesis, float],
    false_alarm: float,
) -> tuple[list[FittedEffect], list[float]]:
    """Refines each member beside the others, replaces it by a better rival, and drops members without BIC gain.

    Effects that the torque shows by itself stay. A member with the same gain as at its last comparison is not compared
    again. Exceptions are rivals that act on a joint of the newest member on which the compared member does not act: the
    newest member may have explained there what the rival would. The best of these rivals is also tried with the others
    refined beside it.

    Args:
        problem: whitened data.
        entries: hypotheses of the catalogue, measured.
        members: effects in the model, the newest last.
        p_values: their p-values.
        seen: effects that the torque shows by itself.
        won: gain of each effect at its last comparison with rivals; updated.
        false_alarm: threshold of the p-values.

    Returns:
        The remaining members and their p-values.
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
            starts = [(problem, o.hypothesis, o.shape) for o in rest[:RIVALS]]
            own, *rivals = _refined([(now, members[i].hypothesis, members[i].shape), *starts], beside)
            rivals.sort(key=lambda m: -m.bic_gain)
            first = max([own, *rivals], key=lambda m: m.bic_gain)
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
    """Returns a member, measured again beside the current others if its BIC gain was too small.

    Before the others had their final shapes, joints may have seemed to disagree.
    """
    m = members[i]
    if m.local_bic_gain > MIN_BIC_GAIN:
        return m
    now = refine(problem, m.hypothesis, m.shape, accept_all_but(problem, members, i), effort=0)
    return replace(m, gain=now.gain, birge_ratio=now.birge_ratio, motion_error_chi2=now.motion_error_chi2)


def _with(
    problem: Problem, members: list[FittedEffect], i: int, rival: FittedEffect, seen: Collection[Hypothesis]
) -> list[FittedEffect]:
    """Replaces a member by a rival, with the others on its joints refined beside it, if this improves the BIC.

    A torque ripple with a fitted delay, for example, leaves no gain there for a delay of all torques.
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
    """Refines candidates from their best shape on the grid, and from known shapes.

    Args:
        problem: whitened data.
        outcomes: candidates of a scan.
        accepted: effects in the model.
        known: further starting shapes.

    Returns:
        The best fit of each hypothesis, the best BIC first.
    """
    starts = [(problem, o.hypothesis, o.shape) for o in outcomes]
    starts += [(problem, o.hypothesis, known[o.hypothesis]) for o in outcomes if known and o.hypothesis in known]
    tops: dict[Hypothesis, FittedEffect] = {}
    for member in sorted(_refined(starts, accepted), key=lambda member: -member.bic_gain):
        tops.setdefault(member.hypothesis, member)
    return list(tops.values())


def _refined(starts: Sequence[tuple[Problem, Hypothesis, tuple[float, ...]]], accepted: Accepted) -> list[FittedEffect]:
    """Refines hypotheses from shapes, all at once.

    A thread must not compute while processes are forked: it may hold a lock, such as that of the Fourier transform's
    tables, which nobody releases in the copy.
    """
    fits = forked(lambda start: refine(*start, accepted), starts)
    # Effects are compared by identity, and a forked process returns a copy.
    return [replace(fit, hypothesis=own) for fit, (_, own, _) in zip(fits, starts, strict=True)]


def remeasure(problem: Problem, member: FittedEffect, beside: Accepted) -> FittedEffect:
    """Measures gain and coefficients of a member again, with the same shape.

    Args:
        problem: whitened data.
        member: effect with its shape.
        beside: other effects in the model.

    Returns:
        The member with new gain, coefficients and visible share.
    """
    result = score(problem, member.group, beside)
    found = result.limited(member.hypothesis, problem.situation.robot, member.shape)
    return replace(member, gain=found.gain, coefficients=found.coefficients, visible=result.visible)


def _acts_on(problem: Problem, hypothesis: Hypothesis) -> tuple[int, ...]:
    return hypothesis.effect.acts_on(problem.situation.robot, hypothesis.joint)


# Hypotheses that are refined at each step.
MAX_CANDIDATES = 7
# Assumed largest ratio of refined gain to grid gain of a transient effect, whose refinement takes longest.
TWICE = 2.0


def screen_candidates(
    problem: Problem, result: Scan, members: Sequence[FittedEffect] = (), least: float = -np.inf
) -> list[Outcome]:
    """Picks the hypotheses that are refined: those with a gain near the best on the grid, and not in the model.

    A transient effect, or one with a change time, must also be able to reach the best BIC gain on the grid.

    Args:
        problem: whitened data.
        result: scan beside the members.
        members: effects in the model; each effect and joint is selected once.
        least: BIC gain that is known to be reached.

    Returns:
        The hypotheses with their best shapes on the grid, the best BIC first.
    """
    taken = {(m.hypothesis.name, m.hypothesis.joint) for m in members}
    able = [o for o in result.outcomes if o.degrees and (o.hypothesis.name, o.hypothesis.joint) not in taken]
    if not able:
        return []

    def worth(outcome: Outcome) -> float:
        return float(outcome.gain - outcome.degrees * np.log(problem.rows))

    def reached(outcome: Outcome, times: float = 1.0) -> float:
        """Returns the BIC gain with free shape parameters counted, at a multiple of the grid gain."""
        effect, joint = outcome.hypothesis.effect, outcome.hypothesis.joint
        free = sum(high > low for low, high in effect.bounds(problem.state_for(effect), joint))
        rows = problem.rows * len(effect.acts_on(problem.situation.robot, joint))
        return float(times * outcome.gain - (outcome.degrees + free) * np.log(rows))

    ranked = sorted(able, key=worth, reverse=True)
    best, top = max(o.gain for o in able), max(*map(reached, ranked[:MAX_CANDIDATES]), least)
    hopeless = {o.hypothesis for o in able if _of_a_moment(o.hypothesis.effect) and reached(o, TWICE) < top}
    return [o for o in ranked if o.gain >= MIN_CANDIDATE_GAIN * best and o.hypothesis not in hopeless][:MAX_CANDIDATES]


def _of_a_moment(effect: Effect) -> bool:
    return effect.persistence is Persistence.TRANSIENT or any(shape.moment for shape in effect.shapes)
