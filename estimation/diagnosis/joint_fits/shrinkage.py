"""Priors of effect coefficients by empirical Bayes: they bound directions that the logs hardly determine."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize_scalar

from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect, accept_all_but
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.scoring import Score, score
from estimation.regressions.parameter_priors import GaussianPrior
from robots.common.arrays import Array

# Logarithms of the prior energies that are tried, in units of the noise variance.
ENERGIES = np.linspace(-2.0, 25.0, 109)
# Directions with a smaller share of visible energy contain no information on the effect's size.
FAINT = 1e-9


def shrinkage_precision(result: Score) -> Array:
    """Returns the prior precision (k,) of an effect's coefficients, estimated from the data.

    Each column is assumed to have the same prior energy e, c_i ~ N(0, e / |x_i|^2). e maximises the marginal likelihood
    (empirical Bayes, Morris 1983). Well determined directions keep their least-squares value within its error.
    Directions that base model or other columns nearly absorb are shrunk towards zero.

    Args:
        result: score of the effect beside all others.
    """
    raw = np.where(np.isfinite(result.raw), result.raw, np.diag(result.gram))
    # A column that is zero in these logs gets a prior at zero, because it may act in other data.
    raw = np.maximum(raw, max(1e-12 * float(raw.max(initial=0.0)), 1e-300))
    scale = 1.0 / np.sqrt(raw)
    shown, directions = np.linalg.eigh(result.gram * scale[:, None] * scale)
    kept = shown > FAINT
    if not kept.any():
        return np.zeros(len(raw))
    shown = shown[kept]
    squares = (directions[:, kept].T @ (scale * result.cross)) ** 2 / shown

    def cost(energy: float) -> float:
        variance = 1.0 + shown * np.exp(energy)
        return float(np.sum(squares / variance + np.log(variance)))

    best = float(ENERGIES[int(np.argmin([cost(energy) for energy in ENERGIES]))])
    step = float(ENERGIES[1] - ENERGIES[0])
    energy = minimize_scalar(cost, bounds=(best - step, best + step), method="bounded").x
    return np.asarray(raw / np.exp(energy))


def effects_prior(problem: Problem, members: Sequence[FittedEffect]) -> GaussianPrior:
    """Returns the prior of base model, nuisance and effect coefficients (b + m + k,).

    It includes the reversal timing of effects that delay all torque.

    Args:
        problem: data and base model.
        members: the effects.

    Returns:
        The prior, in units of plain rows.
    """
    pull = problem.prior
    own, targets = [], []
    for i, member in enumerate(members):
        others = accept_all_but(problem, members, i)
        precision, target = shrinkage_precision(score(problem, member.group, others)), np.zeros(member.group.size)
        if member.group.reversal_columns is not None and problem.timing is not None:
            timed = np.sum(member.group.reversal_columns**2, axis=0)
            target = member.group.reversal_columns.T @ problem.timing.residual / (timed + precision)
            precision = precision + timed
        own.append(problem.whitening.row_weight * precision)
        targets.append(target)
    added = np.concatenate([np.zeros(0), *own])
    known = len(pull.target)
    precision = np.zeros((known + len(added),) * 2)
    precision[:known, :known] = pull.precision
    precision[range(known, len(precision)), range(known, len(precision))] = added
    return GaussianPrior(precision, np.concatenate([pull.target, *targets]))
