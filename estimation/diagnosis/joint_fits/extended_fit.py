"""Joint fit of base parameters and all effects, with their covariance: the extended model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect, accept_all_but
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.scoring import accept, score
from estimation.diagnosis.joint_fits.event_window import open_event_edges
from estimation.diagnosis.joint_fits.shape_errors import (
    formula_errors,
    shape_errors,
    spread_over_pauses,
    widen_change_times,
    with_value,
)
from estimation.diagnosis.joint_fits.shrinkage import effects_prior
from estimation.identifications.verdicts import DETERMINED_ERROR, NEGLIGIBLE_TORQUE
from estimation.models.extension import Extension
from estimation.models.model import Model
from estimation.regressions.moments import Moments
from estimation.uncertainty.blocks import widened_by_blocks
from estimation.uncertainty.quantiles import NORMAL_95
from robots.common.arrays import Array
from robots.terms.effect_bases.capabilities import AboveBand, AtReversals

FAINT = 1e-7  # directions with less than FAINT**1.5 of the largest eigenvalue are not determined
# A column with a smaller norm counts as zero, because its inverse square would overflow.
NOTHING = 1e-100
# A coefficient is undetermined if more than this share of it is in undetermined directions.
LOST = 0.01


@dataclass(frozen=True, eq=False)
class ExtendedFit:
    """Base parameters and effects, fitted together.

    Attributes:
        model: the model with its extensions.
        effects: for each extension, which of its parameters the data determine (k + s,).
        values: base parameters and nuisance (b + m,).
    """

    model: Model
    effects: tuple[NDArray[np.bool_], ...]
    values: Array


def fit_extended(problem: Problem, members: Sequence[FittedEffect], provenance: dict[str, object]) -> ExtendedFit:
    """Fits base parameters and effect coefficients by generalised least squares, for the refined shapes.

    The covariance includes the shape parameters, through the derivative of each effect's torque.

    Args:
        problem: data and base model.
        members: the effects.
        provenance: origin of the model, as stored in it.
    """
    baseline, white = problem.baseline, problem.whitening
    base = baseline.columns
    blocks, slices, deviations = [base], [], []
    at = base.shape[2]
    fitted_members: list[FittedEffect] = []
    for i, member in enumerate(members):
        rest = [m for k, m in enumerate(members) if k != i]
        # The error of a change time within a pause is measured from its middle, not from the edge that was found.
        member = spread_over_pauses(problem, member, rest)
        steps = shape_errors(problem, member, accept(problem, tuple(m.group for m in rest)))
        steps = open_event_edges(problem, member, rest, widen_change_times(problem, member, rest, steps))
        fitted_members.append(member)
        X = problem.dense(member.hypothesis, member.shape)
        slopes = [_slope(problem, member, k, abs(step)) for k, step in enumerate(steps)]
        blocks += [X, *slopes]
        slices.append((at, X.shape[2], len(member.shape)))
        deviations.append(steps)
        at += X.shape[2] + len(member.shape)
    members, columns = fitted_members, np.concatenate(blocks, axis=2)
    fast, kicks = np.zeros((2, columns.shape[2]), dtype=bool)
    for member, (start, size, shapes) in zip(members, slices, strict=True):
        rows, effect = slice(start, start + size + shapes), member.hypothesis.effect
        fast[rows], kicks[rows] = effect.above_band is not AboveBand.NO, effect.at_reversals is AtReversals.IMPACT
    flat, tau = white.independent(columns), white.independent(problem.recording.tau)
    plain = len(tau)
    if problem.high_band is not None and fast.any():
        above, beyond = problem.high_band.regression(columns[:, :, fast], calm=kicks[fast])
        higher = np.zeros((len(above), len(fast)))
        higher[:, fast] = above
        flat, tau = np.concatenate([flat, higher]), np.concatenate([tau, beyond])
    linear = np.ones(columns.shape[2], dtype=bool)
    for start, size, shapes in slices:
        linear[start + size : start + size + shapes] = False
    values = np.zeros(columns.shape[2])
    known = np.zeros(columns.shape[2], dtype=bool)
    forms = [np.zeros((0, columns.shape[2]))]
    for i, (member, (start, size, _)) in enumerate(zip(members, slices, strict=True)):
        effect = member.hypothesis.effect
        if effect.constrained:
            beside = accept_all_but(problem, members, i)
            found = score(problem, member.group, beside).limited(
                member.hypothesis, problem.situation.robot, member.shape
            )
            known[start : start + size], values[start : start + size] = True, found.coefficients
            held = effect.form_rows(found.coefficients, member.shape)
            forms.append(np.zeros((len(held), columns.shape[2])))
            forms[-1][:, start : start + size] = held
    free = flat[:, linear & ~known]
    # The prior is stated for plain rows of the log; `row_weight` converts it to white rows.
    pull = effects_prior(problem, members).columns(np.flatnonzero(~known[linear])).times(1.0 / white.row_weight)
    moments = Moments.of(free[:, None], (tau - flat[:, known] @ values[known])[:, None])
    values[linear & ~known] = moments.pulled(pull).posterior()
    by_reversals = reversal_columns(members, [start for start, *_ in slices], (problem.n, flat.shape[1]))
    covariance, unseen = _covariance(np.concatenate([flat, by_reversals, *forms]))
    covariance = widened_by_blocks(covariance, flat[:plain], (tau - flat @ values)[:plain])
    lower_upper = [m.hypothesis.coefficient_bounds(problem.situation.robot, m.shape) for m in members]
    extensions, determined_of = [], []
    for member, (start, size, shapes), steps, (lower, upper) in zip(
        members, slices, deviations, lower_upper, strict=True
    ):
        rows = slice(start, start + size + shapes)
        # Estimates that disagree between joints, or near and far from reversals, have a larger variance.
        own = covariance[rows, rows] * member.birge_ratio
        scale = np.concatenate([np.ones(size), np.abs(steps)])
        # An undetermined parameter keeps its infinite error.
        open_ = ~np.isfinite(scale)
        scale[open_] = 1.0
        open_[:size] |= unseen[start : start + size]
        own = own * scale[:, None] * scale
        # The profile is not a parabola, least of all for a change time. Its width is a lower bound of the error.
        profile = np.concatenate([np.zeros(size), scale[size:]])
        wider = np.maximum(profile / np.sqrt(np.maximum(np.diag(own), 1e-9 * profile**2 + 1e-300)), 1.0)
        own = own * wider[:, None] * wider
        own[range(len(own)), range(len(own))] = np.maximum(np.diag(own), profile**2)
        own[open_, open_] = np.inf
        coefficients = np.clip(values[start : start + size], lower, upper)
        own[range(len(own)), range(len(own))] += formula_errors(problem, member, coefficients) ** 2
        for i, k, apart in member.hypothesis.effect.ties(coefficients):
            own = _narrowed(own, size + k, float(np.hypot(np.sqrt(own[i, i]), apart / NORMAL_95)))
        errors = np.sqrt(np.maximum(np.diag(own), 0.0))
        determined = np.concatenate(
            [
                np.isfinite(errors[:size]) & (errors[:size] < 0.5 * np.max(np.abs(coefficients), initial=1e-300)),
                np.array([bool(np.isfinite(step)) for step in steps], dtype=bool),
            ]
        )
        own[~np.isfinite(own)] = np.inf
        extensions.append(
            Extension(
                effect=member.hypothesis.name,
                joint=member.hypothesis.joint,
                shape=member.shape,
                coefficients=coefficients,
                covariance=own,
            )
        )
        determined_of.append(determined)
    b = baseline.base.size
    errors = np.sqrt(np.maximum(np.diag(covariance)[:b], 0.0))
    model = Model(
        torque_model=baseline.base.model,
        columns=baseline.base.independent,
        values=values[:b],
        covariance=covariance[:b, :b],
        determined=_determined(problem, values[:b], errors),
        formulas=baseline.base.formulas(),
        provenance=provenance,
        extensions=tuple(extensions),
        felt=problem.parameters_without_payload[list(baseline.base.independent)],
        bearing=problem.extra_load,
        since=problem.situation.origin,
    )
    return ExtendedFit(model, tuple(determined_of), values[: base.shape[2]])


def reversal_columns(members: Sequence[FittedEffect], starts: Sequence[int], shape: tuple[int, int]) -> Array:
    """Returns the rows by which reversal timing enters a joint fit, one per joint.

    Args:
        members: the effects.
        starts: first column of each effect.
        shape: number of joints n, and number of columns p.

    Returns:
        (n, p), relative to the errors of the timing.
    """
    rows = np.zeros(shape)
    for member, start in zip(members, starts, strict=True):
        if member.group.reversal_columns is not None:
            rows[:, start : start + member.group.size] = member.group.reversal_columns
    return rows


def _slope(problem: Problem, member: FittedEffect, k: int, step: float) -> Array:
    """Returns the change of an effect's torque (N, n, 1) per standard error of a shape parameter."""
    value = member.shape[k]
    h = step if np.isfinite(step) else 0.3 * abs(value)
    low, high = member.hypothesis.effect.bounds(problem.state_for(member.hypothesis.effect), member.hypothesis.joint)[k]
    up, down = min(value + h, high), max(value - h, low)
    if up <= down:
        return np.zeros((len(problem.recording), problem.n, 1))
    above, below = (problem.dense(member.hypothesis, with_value(member.shape, k, x)) for x in (up, down))
    return ((above - below) @ member.coefficients * (h / (up - down)))[:, :, None]


def _narrowed(covariance: Array, k: int, error: float) -> Array:
    """Limits the standard error of parameter k in a covariance to `error`."""
    if not np.isfinite(covariance[k, k]):
        result = covariance.copy()
        result[k] = result[:, k] = 0.0
        result[k, k] = error**2
        return result
    scale = np.ones(len(covariance))
    scale[k] = min(1.0, error / max(float(np.sqrt(covariance[k, k])), 1e-300))
    return np.asarray(covariance * scale[:, None] * scale)


def _covariance(matrix: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Returns the covariance of minimum-norm least squares from the data alone, without the prior.

    Also returns a mask (p,) of the coefficients that the data do not determine. Their variance is that of the minimum
    norm.

    Args:
        matrix: the columns (N, p).
    """
    norms = np.linalg.norm(matrix, axis=0)
    norms[norms < NOTHING] = 1.0
    values, vectors = np.linalg.eigh((matrix.T @ matrix) / norms[:, None] / norms)
    kept = values > FAINT**1.5 * values[-1]
    inverse = (vectors[:, kept] / values[kept]) @ vectors[:, kept].T
    lost = (vectors[:, ~kept] ** 2).sum(axis=1) > LOST
    return np.asarray(inverse / norms[:, None] / norms), lost


def _determined(problem: Problem, values: Array, errors: Array) -> NDArray[np.bool_]:
    """Marks base parameters with a small relative error, or with an error too small to matter for the torque."""
    Y = problem.baseline.regressor
    torque = np.sqrt(np.mean(problem.recording.tau**2, axis=0))
    excited = np.sqrt(np.mean(Y**2, axis=0))
    share = (errors * excited / np.maximum(torque, 1e-12)[:, None]).max(axis=0)
    known: NDArray[np.bool_] = (errors <= DETERMINED_ERROR * np.abs(values)) | (share <= NEGLIGIBLE_TORQUE)
    return known & (excited.max(axis=0) > 0) & (errors > 0)
