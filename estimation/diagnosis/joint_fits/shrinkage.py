"""What holds the coefficients of effects that were found: directions that the logs hardly tell must not run away."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import FittedEffect
from estimation.diagnosis.hypothesis_tests.scoring import Score, accept, score
from estimation.regressions.parameter_priors import GaussianPrior

Array = NDArray[np.float64]

# Logarithms of the energies that are tried for a column, in units of the noise's.
ENERGIES = np.linspace(-2.0, 25.0, 109)
# Directions that show less than this share of their energy beside all else say nothing of the effect's size.
FAINT = 1e-9


def shrinkage_precision(result: Score) -> Array:
    """Gives the a-priori precision (k,) of an effect's coefficients, as the data themselves ask for it.

    Each column is taken to make a torque of the same a-priori energy e, c_i ~ N(0, e / |x_i|^2), and e is what makes
    the data likeliest (empirical Bayes; Morris 1983). Directions that are well measured keep their least-squares value
    to within their error; those that base model or other columns nearly imitate stay where the others suggest.
    """
    raw = np.where(np.isfinite(result.raw), result.raw, np.diag(result.gram))
    # A column that does not act here stays at zero, and may act elsewhere.
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
    """Gives the pull on base model, nuisance and the coefficients of members (b + m + k,), in units of plain rows."""
    pull = problem.prior
    own, targets = [], []
    for i, member in enumerate(members):
        others = accept(problem, tuple(m.group for k, m in enumerate(members) if k != i))
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
