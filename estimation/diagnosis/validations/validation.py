"""Validation of findings on held-out data, with the torque and with encoders behind the gears."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from estimation.diagnosis.base_models.payload_and_gravity import build_situation
from estimation.diagnosis.base_models.prepared_logs import PreparedLogs
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.hypotheses import all_hypotheses
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine_member
from estimation.diagnosis.hypothesis_tests.scan import measure
from estimation.diagnosis.recordings.recording import cut_recording
from estimation.diagnosis.validations.equivalent_shapes import complete_effects, equivalent_shapes
from estimation.diagnosis.validations.gear_compliance import MeasuredCompliance, measure_gear_compliance
from estimation.diagnosis.validations.held_out_errors import HeldOutResult, measure_held_out
from estimation.diagnosis.validations.held_out_validation import validate_on_held_out
from estimation.diagnosis.validations.name_comparison import ComparedNames, free_functions
from estimation.diagnosis.validations.validated_findings import ValidatedFindings
from robots.robot import Robot
from robots.terms.discrepancies.patterns import all_patterns
from robots.terms.effect_bases.capabilities import Persistence


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

    validated = validate_on_held_out(
        whole,
        lambda members, absent: measure_held_out(robot, problem, members, prepared.held_out, seed, absent),
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
