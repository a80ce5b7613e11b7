"""Builds the result: fits the extended model, validates it on held-out data, and words the findings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.base_models.payload_and_gravity import build_situation
from estimation.diagnosis.calibration import CLOSE_RIVAL_BIC
from estimation.diagnosis.experiment_plans.detection_limits import Limit
from estimation.diagnosis.experiment_plans.next_experiment import NextExperiment, plan_next
from estimation.diagnosis.hypothesis_tests.hypotheses import all_hypotheses
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import FittedEffect
from estimation.diagnosis.hypothesis_tests.scan import measure
from estimation.diagnosis.joint_fits.extended_fit import fit_extended
from estimation.diagnosis.recordings.recording import cut_recording
from estimation.diagnosis.results.diagnosis import Diagnosis, Trace
from estimation.diagnosis.results.notes import (
    beside_larger,
    farther_joints,
    faster_joints,
    notes_of,
    state_change,
    turning_joints,
    worse_joints,
)
from estimation.diagnosis.results.wording import no_part, word_finding
from estimation.diagnosis.searches.selection import SelectedEffect, Selection
from estimation.diagnosis.validations.comparison import has_close_rivals
from estimation.diagnosis.validations.decision import Reason, decide
from estimation.diagnosis.validations.equivalent_shapes import complete_effects, equivalent_shapes
from estimation.diagnosis.validations.free_functions import strongest_pattern
from estimation.diagnosis.validations.gain_intervals import HeldOutErrors
from estimation.diagnosis.validations.gear_compliance import EFFECT as ELASTICITY
from estimation.diagnosis.validations.gear_compliance import MeasuredCompliance, measure_gear_compliance
from estimation.diagnosis.validations.held_out_errors import HeldOutResult, measure_held_out
from estimation.diagnosis.validations.held_out_simulation import simulate_held_out
from estimation.diagnosis.validations.held_out_validation import validate_on_held_out
from estimation.diagnosis.validations.prediction_settings import (
    all_row_errors,
    with_band,
    with_best_cutoff,
    with_best_sign_sharpness,
)
from estimation.diagnosis.validations.verdict import Verdict
from estimation.logs.provenance import describe_logs
from robots.robot import Robot
from robots.signals import Log
from robots.terms.discrepancies.patterns import all_patterns
from robots.terms.effects import Effect
from robots.version import VERSION

Array = NDArray[np.float64]

SHOWN = 4000  # rows of the curves kept for pictures


@dataclass(frozen=True, eq=False)
class DiagnosisInputs:
    """Inputs of the final step of a diagnosis."""

    problem: Problem
    selection: Selection
    verdict: Verdict
    limits: tuple[Limit, ...]
    excess: Array
    logs: tuple[Log, ...]
    held_out: tuple[Log, ...]
    false_alarm: float
    seed: int
    dated: bool = True
    notes: tuple[str, ...] = ()


def assemble(robot: Robot, inputs: DiagnosisInputs) -> Diagnosis:
    """Fits the extended model, validates it on held-out data, and words the findings."""
    problem = inputs.problem
    judged = replace(inputs.verdict, named=complete_effects(problem, inputs.verdict.named))
    held = validate_on_held_out(
        judged,
        lambda members, absent: measure_held_out(robot, problem, members, inputs.held_out, inputs.seed + 3, absent),
        partial(_is_beyond, inputs),
        partial(equivalent_shapes, problem),
        lambda member: member.local_bic_gain(problem.rows),
        partial(_unnamed, robot, inputs),
    )
    members, selected, seen = held.effects, held.findings, held.measured
    compliances = _compliances(inputs, seen)
    decision = decide(
        causes=len(selected) + len(compliances),
        close_rivals=any(map(has_close_rivals, selected)),
        free_functions=len(members) - len(selected),
        rejected_free_functions=len(held.rejected_discrepancies),
        rejected_causes=len(held.refuted),
    )
    # An effect that held-out data reject still shows where the residual is unexplained.
    refuted = held.refuted if decision.reason is Reason.REJECTED_CAUSES else ()
    rejected_functions = held.rejected_discrepancies or refuted
    fitted = fit_extended(problem, members, _provenance(inputs))
    findings = tuple(
        word_finding(
            robot,
            problem,
            member,
            fitted,
            i,
            held.p_values[i],
            selected[i] if i < len(selected) else None,
            seen.gains[i],
        )
        for i, member in enumerate(members)
    )
    order = sorted(range(len(findings)), key=lambda i: -findings[i].delta_bic)
    findings = tuple(findings[i] for i in order)
    if rejected_functions:
        fit = fit_extended(problem, [*members, *(member for member, _, _ in rejected_functions)], {})
        findings += tuple(
            no_part(word_finding(robot, problem, member, fit, i, p_value, None, gain))
            for i, (member, p_value, gain) in enumerate(rejected_functions, start=len(members))
        )
    unseen, apart = seen.errors, findings[len(members) :]
    findings += tuple(windup.finding for windup in compliances)
    known = {extension.joint for extension in fitted.model.extensions if extension.effect == ELASTICITY}
    added = [windup.extension for windup in compliances if windup.extension.joint not in known]
    simulation = simulate_held_out(problem, members, seen, bool(inputs.held_out)) if members else None
    lost = (_LOST,) if members and simulation is None else ()
    timed = [member for member in members if member.group.by_reversals]
    whole = replace(fitted.model, extensions=(*fitted.model.extensions, *added))
    whole = with_best_sign_sharpness(with_best_cutoff(whole, problem, inputs.logs), inputs.logs)
    model = with_band(whole, inputs.logs, inputs.held_out, unseen)
    # A joint that rests in all held-out data has no error: NaN, not zero.
    shown = unseen.counts.any(axis=0)
    before, after = (np.where(shown, unseen.nrmse(model), np.nan) for model in (0, len(unseen.errors) - 1))
    return Diagnosis(
        verdict=decision.verdict,
        findings=findings,
        baseline=before,
        extended=after,
        explained=judged.explained,
        excess=inputs.excess,
        limits=inputs.limits,
        next_experiment=_next(problem, selected) if decision.reason is Reason.CLOSE_RIVALS else None,
        model=model,
        how_unseen=unseen.how,
        notes=_each_once(
            *inputs.notes,
            *notes_of(problem, inputs.false_alarm, findings, apart, after, [m.hypothesis.name for m in timed]),
            *worse_joints(before, after),
            *turning_joints(all_row_errors(model), after, unseen.counts),
            *faster_joints(problem, seen),
            *farther_joints(problem, seen, findings),
            *map(state_change, held.changes),
            *beside_larger(inputs.selection.strongest_unaccepted, members),
            *lost,
        ),
        trace=_trace(unseen, [seen.coordinates[i] for i in order], compliances),
        simulation=simulation,
    )


def _each_once(*notes: str) -> tuple[str, ...]:
    """Removes duplicates: several functions of one joint have the same note."""
    return tuple(dict.fromkeys(notes))


def _is_beyond(inputs: DiagnosisInputs, effect: Effect) -> bool:
    """Whether held-out logs cannot test an effect because it belongs to the fitted logs: a contact, a drift.

    If the recording times are unknown, they cannot test time-dependent effects either.
    """
    if any(f.effect.hypothesis.effect is effect and f.effect.group.by_reversals for f in inputs.selection.found):
        return True
    if not inputs.held_out:
        return False
    return effect.transient or (not inputs.dated and effect.depends_on == "time")


def _unnamed(
    robot: Robot, inputs: DiagnosisInputs, member: FittedEffect, beside: Sequence[FittedEffect]
) -> tuple[FittedEffect, float] | None:
    """Finds a free function on the joint of a rejected effect, or on all joints for an effect of the whole robot."""
    own = member.hypothesis.joint
    wanted = [h for h in all_hypotheses(robot, list(all_patterns(robot))) if own is None or h.joint == own]
    entries = measure(inputs.problem, wanted)
    return strongest_pattern(inputs.problem, entries, beside, inputs.false_alarm)


_LOST = (
    "The forward simulation of the extended model was unstable under the position loop. Do not use it for simulation."
)


def _compliances(inputs: DiagnosisInputs, seen: HeldOutResult) -> tuple[MeasuredCompliance, ...]:
    """Measures gears with logged wind-up; their gain is measured on held-out logs that have link positions too."""
    if all(log.qlink is None for log in inputs.logs):
        return ()
    now, unseen = inputs.problem.situation, None
    if any(log.qlink is not None for log in inputs.held_out):
        other = cut_recording(seen.whole, slice(seen.first_held_out_row, len(seen.whole)))
        there = build_situation(other, now.model, inputs.problem.parameters_without_payload)
        unseen = (there, other, inputs.held_out)
    return measure_gear_compliance(
        now, inputs.problem.recording, inputs.logs, false_alarm=inputs.false_alarm, unseen=unseen
    )


def _next(problem: Problem, selected: Sequence[SelectedEffect]) -> NextExperiment | None:
    """Plans the experiment that distinguishes the remaining causes."""
    for found in selected:
        close = [rival for rival, worse in found.rivals if worse < CLOSE_RIVAL_BIC]
        if close:
            return plan_next(problem, [found.effect, *close])
    return None


def _trace(unseen: HeldOutErrors, seen_as: Sequence[Array], windups: Sequence[MeasuredCompliance]) -> Trace:
    rows = slice(None, None, max(1, len(unseen.t) // SHOWN))
    hidden = ~unseen.counts
    before, after = (np.where(hidden, np.nan, unseen.errors[k]) for k in (0, -1))
    coordinates = tuple(values[rows] for values in seen_as)
    curves = tuple(
        tuple(values[:: max(1, len(values) // SHOWN)] for values in (w.coordinate, w.before, w.after)) for w in windups
    )
    return Trace(unseen.t[rows], unseen.measured[rows], before[rows], after[rows], coordinates, curves)


def _provenance(inputs: DiagnosisInputs) -> dict[str, object]:
    problem = inputs.problem
    torque = np.sqrt(np.mean(problem.recording.tau**2, axis=0))
    return {
        "logs": describe_logs(inputs.logs),
        "method": "diagnosis",
        "tool_version": VERSION,
        "cutoff_hz": float(max(problem.recording.cutoff, *(band.cutoff for band in problem.whitening.bands))),
        "velocity_scales": [float(v) for v in problem.situation.velocity_scale],
        "seed": inputs.seed,
        "false_alarm": inputs.false_alarm,
        "residual_rms": np.sqrt(np.mean(problem.base_residual**2, axis=0)).tolist(),
        "torque_rms": torque.tolist(),
        "gravities": [list(gravity) for gravity in problem.baseline.base.gravities],
    }
