"""Extended model of a diagnosis: base model and findings fitted together, with its settings for prediction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimation.diagnosis.base_models.baseline import SCALES
from estimation.diagnosis.base_models.prepared_logs import PreparedLogs
from estimation.diagnosis.findings import Gain
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.joint_fits.extended_fit import ExtendedFit, fit_extended
from estimation.diagnosis.validations.gain_intervals import PARTS, HeldOutErrors
from estimation.diagnosis.validations.gear_compliance import EFFECT as ELASTICITY
from estimation.diagnosis.validations.validated_findings import Decision, Reason, ValidatedFindings
from estimation.identifications.identification import recorded_ranges
from estimation.logs.provenance import describe_logs
from estimation.models.model import Model
from estimation.predictions.prediction import Prediction, predict
from estimation.regressions.preparation import torque_of
from estimation.uncertainty.quantiles import band_of
from robots.common.arrays import Array
from robots.common.plain import all_finite, number
from robots.signals import Log
from robots.terms import FrictionTerm
from robots.terms.situations.of_model import sign_of, velocity_scale
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


# Length [s] of the stretch, in the middle of the longest log, on which settings are chosen; number of cut-offs tried.
STRETCH, POINTS = 30.0, 5
# Smallest number of rows of an earlier log from which heat is computed.
FEWEST = 50


def with_best_cutoff(model: Model, problem: Problem, logs: Sequence[Log]) -> Model:
    """Sets the low-pass cut-off with which a model predicts its own logs best.

    The diagnosis has a cut-off per joint, a prediction one for all joints. With the highest, encoder noise dominates
    the error of a heavy joint. With the lowest, the friction of a fast joint changes sign late.

    Args:
        model: extended model.
        problem: data of the fit.
        logs: logs of the fit, with torque.

    Returns:
        The model with the cut-off [Hz] in its provenance.
    """
    cutoffs = [problem.recording.cutoff, *(band.cutoff for band in problem.whitening.bands)]
    low, high = min(cutoffs), max(cutoffs)
    part, before = _part(model, logs)
    tried = np.geomspace(low, high, POINTS if high > low else 1)
    stated = [replace(model, provenance={**model.provenance, "cutoff_hz": float(cutoff)}) for cutoff in tried]
    return min(stated, key=lambda one: _misfit(one, part, before))


def with_best_sign_sharpness(model: Model, logs: Sequence[Log]) -> Model:
    """Sets the width of each joint's friction sign with which a model predicts its own logs best.

    The diagnosis leaves out rows at reversals. The remaining rows may fit any width, so that the friction of the model
    may change sign too gradually. A prediction contains the rows at reversals, too.

    Args:
        model: extended model.
        logs: logs of the fit, with torque.

    Returns:
        The model with the widths v0 of tanh(dq / v0) [rad/s or m/s] in its terms and its provenance.
    """
    columns = zip(model.parameters, model.values, strict=True)
    signs = {column.joint - 1: float(value) for column, value in columns if column.symbol == "f1"}
    (part, earlier), now = _part(model, logs), velocity_scale(model.torque_model)
    before = _predicted(model, part, earlier)
    error, chosen = _error(before), now.copy()
    for joint, coulomb in signs.items():
        dq = before.motion.dq[:, joint]
        own = error[:, joint] + coulomb * sign_of(dq, now[joint])
        squares = [np.nansum((own - coulomb * sign_of(dq, v0)) ** 2) for v0 in (now[joint], *SCALES)]
        chosen[joint] = (now[joint], *SCALES)[int(np.argmin(squares))]
    trial = _with_scales(model, chosen)
    # Effects use the same width: with them, the new width may increase the error of a joint.
    better = _predicted(trial, part, earlier).error_rms < before.error_rms
    return _with_scales(model, np.where(better, chosen, now)) if better.any() else model


def _part(model: Model, logs: Sequence[Log]) -> tuple[Log, list[Log]]:
    """Returns the middle of the longest log, and the rows before it."""
    log = max(logs, key=lambda log: float(log.t[-1] - log.t[0]))
    middle = 0.5 * float(log.t[0] + log.t[-1])
    part = log.rows(slice(*np.searchsorted(log.t, (middle - 0.5 * STRETCH, middle + 0.5 * STRETCH)).tolist()))
    return part, _before(model, part, logs)


def _before(model: Model, log: Log, logs: Sequence[Log]) -> list[Log]:
    """Returns the parts of logs before the start of a log, for a model with thermal memory."""
    if not model.keeps_heat:
        return []
    parts = [own.rows(slice(0, int(np.searchsorted(own.t, log.t[0])))) for own in logs if own.t[0] < log.t[0]]
    return sorted((part for part in parts if len(part) >= FEWEST), key=lambda part: float(part.t[0]))


def _with_scales(model: Model, scales: Array) -> Model:
    """Returns the model with the widths v0 (n,) of its friction signs."""
    stated = tuple(float(v0) for v0 in scales)
    terms = tuple(
        replace(term, velocity_scale=stated) if isinstance(term, FrictionTerm) else term
        for term in model.torque_model.terms
    )
    return replace(
        model,
        torque_model=replace(model.torque_model, terms=terms),
        provenance={**model.provenance, "velocity_scales": list(stated)},
    )


def _misfit(model: Model, log: Log, before: Sequence[Log]) -> float:
    """Computes the mean over joints of the logarithm of the prediction error relative to the torque's spread."""
    spread = _predicted(model, log, before).relative_spread
    errors = spread[np.isfinite(spread) & (spread > 0)]
    return float(np.mean(np.log(errors))) if len(errors) else 0.0


def with_band(model: Model, logs: Sequence[Log], held_out: Sequence[Log], unseen: HeldOutErrors) -> Model:
    """Sets the half-widths of a band that contains 95 % of the model's errors on held-out data.

    The provenance also gets the coverage (n,): the share of each part of the held-out logs that lies in the band from
    the other parts. It also gets the NRMSE on all rows that count in a prediction (n,).

    Args:
        model: extended model.
        logs: logs of the fit, with torque.
        held_out: held-out logs. Without any, the errors on the logs of the fit are scaled by their growth in
            cross-validation.
        unseen: held-out or cross-validation errors.

    Returns:
        The model with half-widths (n,) [N m or N], coverage and NRMSE in its provenance.
    """
    growth = np.ones(model.robot.n) if held_out else unseen.support_growth()
    every = [*logs, *held_out]
    errors = [np.abs(_error(_predicted(model, log, _before(model, log, every)))) * growth for log in held_out or logs]
    covered = np.full(model.robot.n, np.nan)
    if held_out:
        parts = [part for error in errors for part in np.array_split(error, PARTS)]
        inside = [
            np.sum(part <= band_of(np.concatenate(parts[:k] + parts[k + 1 :])), axis=0) for k, part in enumerate(parts)
        ]
        covered = np.sum(inside, axis=0) / np.maximum(np.isfinite(np.concatenate(errors)).sum(axis=0), 1)
    found, torque = np.concatenate(errors), np.concatenate([torque_of(model.robot, log) for log in held_out or logs])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.sqrt(np.nansum(found**2, axis=0) / np.sum(torque**2 * np.isfinite(found), axis=0))
    stated = {
        "band95": all_finite(band_of(found)),
        "band95_coverage": all_finite(covered),
        "unseen_nrmse": all_finite(share),
    }
    return replace(model, provenance={**model.provenance, **stated})


def all_row_errors(model: Model) -> Array:
    """Returns the NRMSE on all held-out rows that `with_band` set.

    Args:
        model: extended model.

    Returns:
        NRMSE (n,); NaN where unknown.
    """
    stated = model.provenance.get("unseen_nrmse")
    return np.full(model.robot.n, np.nan) if stated is None else np.array([number(value) for value in stated])


def _predicted(model: Model, log: Log, before: Sequence[Log] = ()) -> Prediction:
    """Predicts a log, or a part of one, on the same clock as the logs of the fit."""
    return predict(model, log, later=0.0, before=before, check=False)


def _error(prediction: Prediction) -> Array:
    """Errors (N, n), NaN in rows that do not count."""
    assert prediction.measured is not None
    return np.where(prediction.judged, prediction.measured - prediction.predicted, np.nan)
