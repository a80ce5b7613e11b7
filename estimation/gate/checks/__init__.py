"""The questions that are asked of each log: one table, a line each, in the order of their answers.

A file holds the questions about one thing. A new question is a function there, and a line here.
"""

from __future__ import annotations

from estimation.gate.check import Check, Question, asked
from estimation.gate.checks import columns, motion, rows, sampling
from estimation.gate.checks.delays import delays
from estimation.gate.checks.excitation import excitation, undetermined
from estimation.gate.checks.meanings import meanings
from estimation.gate.checks.position_units import position_units
from estimation.gate.checks.unloaded_rest import unloaded_rest
from estimation.gate.checks.velocity_columns import velocity_columns
from estimation.gate.context import Stage
from robots.common.registry import Registry, subclass_check

QUESTIONS: dict[Stage, tuple[Question, ...]] = {
    Stage.RECORDED: (
        rows.too_few_rows,
        motion.static_poses,
        sampling.sampling,
        rows.late_rows,
        rows.repeated_rows,
        columns.held_torques,
        columns.stuck_columns,
        columns.resolution,
        motion.wrapped_angles,
        rows.spikes,
        rows.reader_notes,
        columns.clipping,
        columns.constant_torques,
        columns.same_columns,
        motion.travel,
        motion.jumps,
    ),
    Stage.CLEANED: (position_units, columns.impossible_values),
    Stage.SMOOTHED: (motion.speeds, velocity_columns, rows.too_few_smoothed_rows),
    Stage.FITTED: (
        rows.little_motion,
        rows.few_rows_per_parameter,
        meanings,
        unloaded_rest,
        excitation,
        undetermined,
        delays,
    ),
}

CHECKS: Registry[type[Check]] = Registry(
    "check of a log",
    "robot_oed.checks",
    [asked(question, stage, order) for stage, own in QUESTIONS.items() for order, question in enumerate(own)],
    check=subclass_check(Check),
)


def checks_in_order() -> list[type[Check]]:
    """Lists the checks as they run: by stage, and by order within a stage."""
    return sorted(CHECKS.values(), key=lambda check: (check.stage, check.order, check.name))


__all__ = ["CHECKS", "checks_in_order"]
