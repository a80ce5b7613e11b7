"""Assembles the result of a diagnosis from its stages: findings, errors, notes, curves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimation.diagnosis.base_models.prepared_logs import PreparedLogs
from estimation.diagnosis.calibration import CLOSE_RIVAL_BIC
from estimation.diagnosis.experiment_plans.detection_limits import Limit
from estimation.diagnosis.experiment_plans.next_experiment import NextExperiment, plan_next
from estimation.diagnosis.findings import Finding
from estimation.diagnosis.hypothesis_tests.problem import Problem
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
from estimation.diagnosis.searches.search import Search
from estimation.diagnosis.searches.selection import SelectedEffect
from estimation.diagnosis.simulations.forward_simulation import simulate_held_out
from estimation.diagnosis.validations.extended_model import ExtendedModel, all_row_errors
from estimation.diagnosis.validations.gain_intervals import HeldOutErrors
from estimation.diagnosis.validations.gear_compliance import MeasuredCompliance
from estimation.diagnosis.validations.name_comparison import ComparedNames
from estimation.diagnosis.validations.residual_shares import residual_shares
from estimation.diagnosis.validations.validated_findings import Decision, Reason, ValidatedFindings
from robots.common.arrays import Array
from robots.robot import Robot

SHOWN = 4000  # approximate number of rows of the curves kept for plots


def report(
    robot: Robot,
    found: Search,
    prepared: PreparedLogs,
    limits: tuple[Limit, ...],
    compared: ComparedNames,
    validated: ValidatedFindings,
    decision: Decision,
    extended: ExtendedModel,
    false_alarm: float,
) -> Diagnosis:
    """Assembles the result of a diagnosis from its stages. All decisions are made before.

    Args:
        robot: the robot.
        found: last search.
        prepared: logs of the fit and held-out logs.
        limits: detection limits per effect and joint.
        compared: named effects and free functions before the validation.
        validated: findings after the validation on held-out data.
        decision: verdict and its reason.
        extended: extended model and its fits.
        false_alarm: threshold of the p-values.

    Returns:
        The diagnosis.
    """
    problem, seen, unseen = found.problem, validated.measured, validated.measured.errors
    part = _findings(robot, problem, validated, extended)
    order = sorted(range(len(part)), key=lambda i: -part[i].delta_bic)
    apart = _rejected_findings(robot, problem, validated, extended)
    findings = (*(part[i] for i in order), *apart, *(one.finding for one in validated.compliances))
    simulation = (
        simulate_held_out(problem, validated.effects, seen, bool(prepared.held_out)) if validated.effects else None
    )
    # The error of a joint without counted rows in the held-out data is NaN, not zero.
    shown = unseen.counts.any(axis=0)
    before, after = (np.where(shown, unseen.nrmse(model), np.nan) for model in (0, len(unseen.errors) - 1))
    timed = [member.hypothesis.name for member in validated.effects if member.group.by_reversals]
    notes = (
        *prepared.notes,
        *notes_of(problem, false_alarm, findings, apart, after, timed),
        *worse_joints(before, after),
        *turning_joints(all_row_errors(extended.model), after, unseen.counts),
        *faster_joints(problem, seen),
        *farther_joints(problem, seen, findings),
        *map(state_change, validated.changes),
        *beside_larger(found.selection.strongest_unaccepted, validated.effects),
        *((_LOST,) if validated.effects and simulation is None else ()),
    )
    return Diagnosis(
        verdict=decision.verdict,
        findings=findings,
        baseline=before,
        extended=after,
        explained=compared.explained,
        excess=residual_shares(problem),
        limits=limits,
        next_experiment=_next(problem, validated.findings) if decision.reason is Reason.CLOSE_RIVALS else None,
        model=extended.model,
        how_unseen=unseen.how,
        # Several free functions of one joint have the same note.
        notes=tuple(dict.fromkeys(notes)),
        trace=_trace(unseen, [seen.coordinates[i] for i in order], validated.compliances),
        simulation=simulation,
    )


_LOST = (
    "The forward simulation of the extended model was unstable under the position loop. Do not use it for simulation."
)


def _findings(
    robot: Robot, problem: Problem, validated: ValidatedFindings, extended: ExtendedModel
) -> tuple[Finding, ...]:
    named: list[SelectedEffect | None] = [*validated.findings]
    named += [None] * (len(validated.effects) - len(named))
    return tuple(
        word_finding(robot, problem, member, extended.fit, i, p_value, own, gain)
        for i, (member, p_value, own, gain) in enumerate(
            zip(validated.effects, validated.p_values, named, validated.measured.gains, strict=True)
        )
    )


def _rejected_findings(
    robot: Robot, problem: Problem, validated: ValidatedFindings, extended: ExtendedModel
) -> tuple[Finding, ...]:
    if extended.fit_with_rejected is None:
        return ()
    return tuple(
        no_part(word_finding(robot, problem, member, extended.fit_with_rejected, i, p_value, None, gain))
        for i, (member, p_value, gain) in enumerate(extended.rejected, start=len(validated.effects))
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
