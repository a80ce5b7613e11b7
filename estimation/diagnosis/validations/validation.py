"""Findings validated on held-out data: by the torque, and by encoders behind the gears where there are some."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from estimation.diagnosis.base_models.payload_and_gravity import build_situation
from estimation.diagnosis.base_models.prepared_logs import PreparedLogs
from estimation.diagnosis.hypothesis_tests.hypotheses import all_hypotheses
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import FittedEffect
from estimation.diagnosis.hypothesis_tests.scan import measure
from estimation.diagnosis.recordings.recording import cut_recording
from estimation.diagnosis.validations.equivalent_shapes import complete_effects, equivalent_shapes
from estimation.diagnosis.validations.free_functions import free_functions
from estimation.diagnosis.validations.gear_compliance import MeasuredCompliance, measure_gear_compliance
from estimation.diagnosis.validations.held_out_errors import HeldOutResult, measure_held_out
from estimation.diagnosis.validations.held_out_validation import ValidatedFindings, validate_on_held_out
from estimation.diagnosis.validations.name_comparison import ComparedNames
from robots.robot import Robot
from robots.terms.discrepancies.patterns import all_patterns


def validate(
    robot: Robot, problem: Problem, compared: ComparedNames, prepared: PreparedLogs, *, false_alarm: float, seed: int
) -> ValidatedFindings:
    """Validates what was found on held-out logs, or by leaving out parts of the logs in turn.

    Args:
        robot: the robot.
        problem: the data of the fit.
        compared: named effects and free functions.
        prepared: the logs.
        false_alarm: chance of one.
        seed: of the intervals' resampling.
    """
    whole = replace(compared, named=complete_effects(problem, compared.named))
    by_reversals = {found.effect.hypothesis.name for found in whole.named if found.effect.group.by_reversals}

    def is_beyond(member: FittedEffect) -> bool:
        """Whether held-out logs cannot test an effect because it belongs to the fitted logs: a contact, a drift."""
        effect = member.hypothesis.effect
        if effect.name in by_reversals:
            return True
        # Without the recording times, they cannot test effects of time either.
        return bool(prepared.held_out) and (effect.transient or (not prepared.dated and effect.depends_on == "time"))

    validated = validate_on_held_out(
        whole,
        lambda members, absent: measure_held_out(robot, problem, members, prepared.held_out, seed, absent),
        is_beyond,
        partial(equivalent_shapes, problem),
        partial(_unnamed, robot, problem, false_alarm),
    )
    return replace(validated, compliances=_compliances(problem, prepared, validated.measured, false_alarm))


def _unnamed(
    robot: Robot, problem: Problem, false_alarm: float, member: FittedEffect, beside: Sequence[FittedEffect]
) -> tuple[FittedEffect, float] | None:
    """Finds a free function on the joint of a rejected effect, or on all joints for an effect of the whole robot."""
    own = member.hypothesis.joint
    wanted = [h for h in all_hypotheses(robot, list(all_patterns(robot))) if own is None or h.joint == own]
    members, p_values = free_functions(problem, measure(problem, wanted), beside, false_alarm, alone=True)
    return (members[0], p_values[0]) if members else None


def _compliances(
    problem: Problem, prepared: PreparedLogs, seen: HeldOutResult, false_alarm: float
) -> tuple[MeasuredCompliance, ...]:
    """Measures gears with logged wind-up; their gain is measured on held-out logs that have link positions too."""
    if all(log.qlink is None for log in prepared.logs):
        return ()
    now, unseen = problem.situation, None
    if any(log.qlink is not None for log in prepared.held_out):
        other = cut_recording(seen.whole, slice(seen.first_held_out_row, len(seen.whole)))
        there = build_situation(other, now.model, problem.parameters_without_payload)
        unseen = (there, other, prepared.held_out)
    return measure_gear_compliance(now, problem.recording, prepared.logs, false_alarm=false_alarm, unseen=unseen)
