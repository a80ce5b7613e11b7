"""Extended model of a diagnosis: base model and findings fitted together, with settings for prediction."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from estimation.diagnosis.base_models.prepared_logs import PreparedLogs
from estimation.diagnosis.findings import Gain
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.joint_fits.extended_fit import ExtendedFit, fit_extended
from estimation.diagnosis.validations.gear_compliance import EFFECT as ELASTICITY
from estimation.diagnosis.validations.prediction_settings import with_band, with_best_cutoff, with_best_sign_sharpness
from estimation.diagnosis.validations.validated_findings import Decision, Reason, ValidatedFindings
from estimation.identifications.identification import recorded_ranges
from estimation.logs.provenance import describe_logs
from estimation.models.model import Model
from robots.version import VERSION


@dataclass(frozen=True, eq=False)
class ExtendedModel:
    """Extended model of a diagnosis, and the fits that determine the parameters of its findings.

    Attributes:
        model: base model and findings, with settings for prediction.
        fit: joint fit of base model and the findings that the model contains.
        rejected: significant effects or free functions that held-out data rejected, with p-value and gain.
        fit_with_rejected: joint fit that includes the rejected ones; None without any.
    """

    model: Model
    fit: ExtendedFit
    rejected: tuple[tuple[FittedEffect, float, Gain], ...]
    fit_with_rejected: ExtendedFit | None


def fit_extended_model(
    problem: Problem,
    validated: ValidatedFindings,
    decision: Decision,
    prepared: PreparedLogs,
    *,
    false_alarm: float,
    seed: int,
) -> ExtendedModel:
    """Fits base model and validated findings together, and chooses cut-off, sign sharpness and prediction band.

    Args:
        problem: data of the fit.
        validated: findings after the validation on held-out data.
        decision: verdict and its reason.
        prepared: logs of the fit and held-out logs.
        false_alarm: threshold of the p-values, for the model's provenance.
        seed: seed of the diagnosis, for the model's provenance.

    Returns:
        The extended model and its fits.
    """
    fit = fit_extended(problem, validated.effects, _provenance(problem, prepared, false_alarm, seed))
    # If held-out data reject all causes, the report shows the rejected ones as an unexplained residual.
    refuted = validated.refuted if decision.reason is Reason.REJECTED_CAUSES else ()
    rejected = validated.rejected_discrepancies or refuted
    both = fit_extended(problem, [*validated.effects, *(member for member, _, _ in rejected)], {}) if rejected else None
    known = {extension.joint for extension in fit.model.extensions if extension.effect == ELASTICITY}
    added = [one.extension for one in validated.compliances if one.extension.joint not in known]
    model = replace(fit.model, extensions=(*fit.model.extensions, *added))
    model = with_best_sign_sharpness(with_best_cutoff(model, problem, prepared.logs), prepared.logs)
    model = with_band(model, prepared.logs, prepared.held_out, validated.measured.errors)
    return ExtendedModel(model, fit, rejected, both)


def _provenance(problem: Problem, prepared: PreparedLogs, false_alarm: float, seed: int) -> dict[str, object]:
    recording = problem.recording
    torque = np.sqrt(np.mean(recording.tau**2, axis=0))
    return {
        "logs": describe_logs(prepared.logs),
        "method": "diagnosis",
        "tool_version": VERSION,
        "recorded": recorded_ranges(recording.q, recording.dq, recording.ddq),
        "cutoff_hz": float(max(recording.cutoff, *(band.cutoff for band in problem.whitening.bands))),
        "velocity_scales": [float(v) for v in problem.situation.velocity_scale],
        "seed": seed,
        "false_alarm": false_alarm,
        "residual_rms": np.sqrt(np.mean(problem.base_residual**2, axis=0)).tolist(),
        "torque_rms": torque.tolist(),
        "gravities": [list(gravity) for gravity in problem.baseline.base.gravities],
    }
