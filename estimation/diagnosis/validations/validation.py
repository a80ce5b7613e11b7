"""Validation of findings on held-out data: unsupported ones are rejected, or replaced by what the data support."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from estimation.diagnosis.base_models.payload_and_gravity import build_situation
from estimation.diagnosis.base_models.prepared_logs import PreparedLogs
from estimation.diagnosis.calibration import (
    CLOSE_RIVAL_BIC,
    CONTRADICTION_SHARE,
    FREE_P_VALUE,
    MAX_RMSE_RATIO,
    MIN_BIC_GAIN,
    MIN_RETAINED_GAIN,
    MIN_SUPPORT,
    MIN_SUPPORT_CHI2,
    OSCILLATION_P_VALUE,
    REJECT_RMSE_RATIO,
)
from estimation.diagnosis.findings import Gain
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis, all_hypotheses
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine_member
from estimation.diagnosis.hypothesis_tests.scan import measure
from estimation.diagnosis.recordings.recording import cut_recording
from estimation.diagnosis.searches.selection import SelectedEffect
from estimation.diagnosis.validations.equivalent_shapes import complete_effects, equivalent_shapes
from estimation.diagnosis.validations.gear_compliance import MeasuredCompliance, measure_gear_compliance
from estimation.diagnosis.validations.held_out_errors import HeldOutResult, measure_held_out, read_held_out
from estimation.diagnosis.validations.name_comparison import ComparedNames, free_functions
from estimation.diagnosis.validations.validated_findings import Change, ChangedFinding, ValidatedFindings
from robots.robot import Robot
from robots.terms.discrepancies.patterns import PREFIX, all_patterns, is_of_time, is_oscillation
from robots.terms.effect_bases.capabilities import Persistence
from robots.terms.effects import Effect


def validate(
    robot: Robot, problem: Problem, compared: ComparedNames, prepared: PreparedLogs, *, false_alarm: float, seed: int
) -> ValidatedFindings:
    """Validates findings on held-out logs, or by cross-validation if there are none.

    Args:
        robot: the robot.
        problem: data of the fit.
        compared: named effects and free functions.
        prepared: logs of the fit and held-out logs.
        false_alarm: largest p-value of a free function or a gear compliance.
        seed: seed of the bootstrap intervals.

    Returns:
        The findings that remain, their held-out errors and gains, and the measured gear compliances.
    """
    whole = replace(compared, named=complete_effects(problem, compared.named))
    by_reversals = {found.effect.hypothesis.name for found in whole.named if found.effect.group.by_reversals}

    def is_beyond(member: FittedEffect) -> bool:
        """Whether held-out data cannot test an effect: identified from reversals, or present in fitted logs only."""
        effect = member.hypothesis.effect
        if effect.name in by_reversals:
            return True
        # Without recording times, held-out logs cannot test time-dependent effects either.
        return bool(prepared.held_out) and (
            effect.persistence is Persistence.TRANSIENT
            or (not prepared.dated and effect.persistence is not Persistence.STATE)
        )

    unseen = read_held_out(robot, problem, prepared.held_out)
    validated = validate_on_held_out(
        whole,
        lambda members, absent: measure_held_out(problem, members, unseen, seed, absent),
        is_beyond,
        partial(equivalent_shapes, problem),
        partial(refine_member, problem),
        partial(_unnamed, robot, problem, false_alarm),
    )
    return replace(validated, compliances=_compliances(problem, prepared, validated.measured, false_alarm))


def _unnamed(
    robot: Robot, problem: Problem, false_alarm: float, member: FittedEffect, beside: Sequence[FittedEffect]
) -> tuple[FittedEffect, float] | None:
    """Finds a free function on the joint of a rejected effect, or on any joint for an effect of the whole robot."""
    own = member.hypothesis.joint
    wanted = [h for h in all_hypotheses(robot, list(all_patterns(robot))) if own is None or h.joint == own]
    members, p_values = free_functions(problem, measure(problem, wanted), beside, false_alarm, alone=True)
    return (members[0], p_values[0]) if members else None


def _compliances(
    problem: Problem, prepared: PreparedLogs, seen: HeldOutResult, false_alarm: float
) -> tuple[MeasuredCompliance, ...]:
    """Measures the compliance of gears with `qlink`, and its gain on held-out logs with `qlink` if there are any."""
    if all(log.qlink is None for log in prepared.logs):
        return ()
    now, unseen = problem.situation, None
    if any(log.qlink is not None for log in prepared.held_out):
        other = cut_recording(seen.whole, slice(seen.first_held_out_row, len(seen.whole)))
        there = build_situation(other, now.model, problem.parameters_without_payload)
        unseen = (there, other, prepared.held_out)
    return measure_gear_compliance(now, problem.recording, prepared.logs, false_alarm=false_alarm, unseen=unseen)


def validate_on_held_out(
    compared: ComparedNames,
    measure: Callable[[Sequence[FittedEffect], frozenset[int]], HeldOutResult],
    beyond: Callable[[FittedEffect], bool],
    forms: Callable[[Sequence[FittedEffect], int], Sequence[FittedEffect]],
    again: Callable[[Sequence[FittedEffect], int], FittedEffect],
    unnamed: Callable[[FittedEffect, Sequence[FittedEffect]], tuple[FittedEffect, float] | None],
) -> ValidatedFindings:
    """Rejects effects that increase the held-out error, one after the other, the most certain first.

    An equivalent shape or a close rival that the held-out data support replaces a rejected effect. Otherwise a free
    function for its residual is fitted.

    Args:
        compared: named effects and free functions.
        measure: measures members on held-out data; the second argument contains indices of members absent there.
        beyond: whether held-out data cannot test an effect.
        forms: lists equivalent shapes of one of the members, the most likely first.
        again: refines one of the members beside the others.
        unnamed: finds a free function for the residual of a rejected effect beside other members, and its p-value;
            None if none is significant.

    Returns:
        The findings that remain, their held-out results, and all changes.
    """
    selected = list(compared.named)
    members = [*(found.effect for found in selected), *compared.free_functions]
    p_values = [*(found.p_value for found in selected), *compared.p_values]
    rejected_functions: list[tuple[FittedEffect, float, Gain]] = []
    changes: list[ChangedFinding] = []
    refuted: list[tuple[FittedEffect, float, Gain]] = []
    absent: set[Hypothesis] = set()

    def measure_members(members: Sequence[FittedEffect]) -> HeldOutResult:
        return measure(members, frozenset(i for i, member in enumerate(members) if member.hypothesis in absent))

    seen = measure_members(members)
    while harmful := [i for i, m in enumerate(members) if _is_harmful(seen, i, m, beyond)]:
        worst = min(harmful, key=lambda i: seen.gains[i].ci95[1])
        own = members[worst].hypothesis
        if len(members) == 1 > len(selected) and _is_weak(members[0].hypothesis.effect, p_values[0]):
            # A single barely significant free function that held-out data contradict counts as noise.
            changes.append(ChangedFinding(Change.INSIGNIFICANT, own))
            members.clear()
            p_values.clear()
        elif worst >= len(selected):
            # The model must not contain this free function, but its residual is still unexplained.
            rejected_functions.append((members.pop(worst), p_values.pop(worst), seen.gains[worst]))
        elif (undone := _without_change(members, worst, absent, measure_members)) is not None:
            seen = undone
            changes.append(ChangedFinding(Change.ABSENT, own))
            continue
        elif instead := _alternative(selected[worst], worst, members, measure_members, beyond, forms):
            selected[worst], seen = instead
            members[worst] = selected[worst].effect
            if members[worst].hypothesis != own:
                changes.append(ChangedFinding(Change.REPLACED, own, members[worst].hypothesis))
            continue
        else:
            selected.pop(worst)
            rejected = members.pop(worst)
            refuted.append((rejected, p_values.pop(worst), seen.gains[worst]))
            changes.append(ChangedFinding(Change.REJECTED, own))
            # Effects of the same joint may have been significant only because they compensated the rejected one.
            for i in [i for i, found in enumerate(selected) if found.effect.hypothesis.joint == own.joint][::-1]:
                members[i] = again(members, i)
                selected[i] = replace(selected[i], effect=members[i])
                if members[i].local_bic_gain <= MIN_BIC_GAIN:
                    changes.append(ChangedFinding(Change.INSIGNIFICANT, members[i].hypothesis))
                    for items in (selected, members, p_values):
                        items.pop(i)
            if (free := unnamed(rejected, members)) is not None:
                members.append(free[0])
                p_values.append(free[1])
        seen = measure_members(members)
    lost = {member.hypothesis.joint or 0: member.hypothesis for member, _, _ in rejected_functions}
    changes += [ChangedFinding(Change.FREE_FUNCTION_REJECTED, lost[joint]) for joint in sorted(lost)]
    return ValidatedFindings(
        findings=tuple(selected),
        effects=tuple(members),
        p_values=tuple(p_values),
        measured=seen,
        rejected_discrepancies=tuple(rejected_functions),
        changes=tuple(changes),
        refuted=tuple(refuted),
    )


def _without_change(
    members: Sequence[FittedEffect],
    place: int,
    absent: set[Hypothesis],
    measure_members: Callable[[Sequence[FittedEffect]], HeldOutResult],
) -> HeldOutResult | None:
    """Measures with a change undone on held-out data, such as a removed payload; None without significant gain."""
    hypothesis = members[place].hypothesis
    effect = hypothesis.effect
    comes = (
        effect.persistence is not Persistence.STATE
        and effect.persistence is not Persistence.TRANSIENT
        and any(shape.moment for shape in effect.shapes)
    )
    if hypothesis in absent or not comes:
        return None
    absent.add(hypothesis)
    seen = measure_members(members)
    if seen.gains[place].ci95[0] > 0:
        return seen
    absent.remove(hypothesis)
    return None


def _alternative(
    found: SelectedEffect,
    place: int,
    members: Sequence[FittedEffect],
    measure: Callable[[Sequence[FittedEffect]], HeldOutResult],
    beyond: Callable[[FittedEffect], bool],
    forms: Callable[[Sequence[FittedEffect], int], Sequence[FittedEffect]],
) -> tuple[SelectedEffect, HeldOutResult] | None:
    """Finds an equivalent shape or close rival that held-out data support, and its held-out results.

    If there is none, an equivalent shape that does not increase the held-out error is returned.
    """

    def measured(one: FittedEffect) -> HeldOutResult | None:
        """Measures with another member in place of the rejected one; None if that is harmful, too."""
        seen = measure([*members[:place], one, *members[place + 1 :]])
        return None if _is_harmful(seen, place, one, beyond) else seen

    harmless: list[tuple[SelectedEffect, HeldOutResult]] = []
    for form in forms(members, place):
        if (seen := measured(form)) is not None:
            harmless.append((SelectedEffect(form, found.p_value, found.rivals), seen))
            if seen.gains[place].ci95[0] > 0:
                return harmless[-1]
    close = [(rival, worse) for rival, worse in found.rivals if worse < CLOSE_RIVAL_BIC]
    for k, (rival, worse) in enumerate(close):
        if (seen := measured(rival)) is not None and seen.gains[place].ci95[0] > 0:
            rest = tuple((other, more - worse) for other, more in close[k + 1 :])
            return SelectedEffect(rival, found.p_value, rest), seen
    return harmless[0] if harmless else None


def _is_weak(free: Effect, p_value: float) -> bool:
    """Whether a single free function counts as noise if held-out data contradict it.

    This does not apply to functions of time, which held-out data cannot test.
    """
    return not is_of_time(free) and p_value > (OSCILLATION_P_VALUE if is_oscillation(free) else FREE_P_VALUE)


def _is_harmful(seen: HeldOutResult, i: int, member: FittedEffect, beyond: Callable[[FittedEffect], bool]) -> bool:
    """Whether a member increases the held-out error, significantly or by a large factor.

    A state-dependent effect must retain part of its gain in cross-validation, or have support by held-out rows. An
    effect is also harmful on a joint whose base model the logs do not determine.
    """
    effect, joint = member.hypothesis.effect, member.hypothesis.joint
    if beyond(member):
        return False
    gain, speaks = seen.gains[i], seen.support[i]
    supported = (speaks >= MIN_RETAINED_GAIN and gain.ci95[0] > 0) or (
        speaks >= MIN_SUPPORT and speaks * member.gain > MIN_SUPPORT_CHI2
    )
    if effect.persistence is Persistence.STATE and seen.cv_retained_gain[i] < MIN_RETAINED_GAIN and not supported:
        return True
    if joint is not None and seen.errors.is_unreliable(joint - 1):
        return True
    # A free function has no physical meaning, so only its held-out gain justifies it.
    least = gain.ci95[1] if len(seen.gains) == 1 or is_of_time(effect) else gain.nrmse_before - gain.nrmse_after
    idle = effect.name.startswith(PREFIX) and least < 0
    # Errors of the base model can cause a smaller contradiction.
    against = seen.contradicts[i] and speaks < -CONTRADICTION_SHARE
    # An effect may increase the error because it changes base parameters. With support, the limit is therefore higher.
    risen = (
        seen.rmse_ratio[i] > MAX_RMSE_RATIO
        if speaks < MIN_RETAINED_GAIN
        else seen.rmse_ratio[i] > REJECT_RMSE_RATIO and gain.ci95[0] <= 0
    )
    # Contradiction does not count for thermal effects: heat stored before the held-out data is unknown.
    return (against and effect.persistence is not Persistence.HEAT) or idle or risen
