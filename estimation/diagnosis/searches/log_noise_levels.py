"""Likelihood ratio of an effect if each log has its own noise level."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.problem import Problem

Array = NDArray[np.float64]

# Mean energy of a white row of unit noise after the low-pass.
PASSED = 0.64


def profile_gain(problem: Problem, member: FittedEffect) -> float:
    """Returns twice the log likelihood ratio of an effect, with the noise level of each log free.

    The gain of a `FittedEffect` assumes one noise for all logs, estimated before the effect was known. If an effect
    dominates one log, this noise estimate contains the effect (a hand moves the arm, and the motors only carry it).
    With the level of each log profiled out, the ratio is sum_r N_r log(E_r / E_r'). E_r and E_r' are the squared
    residuals of log r without and with the effect; N_r is its number of white rows minus fitted parameters. For effects
    that are small compared with the noise, both agree.

    Args:
        problem: data and base model.
        member: an effect, fitted beside the base model alone.
    """
    P = problem.whitening.precision
    orthonormal = np.einsum("jk,knb->jnb", np.linalg.inv(P), problem.weighted_base_columns, optimize=True)
    change = -np.einsum("jnb,b->nj", orthonormal, member.group.against.T @ member.coefficients)
    for j, X in zip(member.group.joints, member.group.columns, strict=True):
        change[:, j] += X @ member.coefficients
    squares = [np.einsum("nj,jk,nk->n", r, P, r) for r in (problem.white, problem.white - change)]
    weights = problem.whitening.weights
    counted = np.full(problem.rows, float(problem.n)) if weights is None else (weights > 0).sum(axis=1).astype(float)
    stride = problem.whitening.stride
    lengths = [-(-(run.stop - run.start) // stride) for run in problem.recording.runs]
    edges = np.cumsum([0, *lengths])
    rows = np.array([PASSED * counted[a:b].sum() for a, b in pairwise(edges)])
    fitted = problem.weighted_base_columns.shape[2] * rows / max(rows.sum(), 1e-300)
    before, after = (np.array([x[a:b].sum() for a, b in pairwise(edges)]) for x in squares)
    usable = (rows > 2 * fitted) & (after > 0)
    return float(np.sum((rows - fitted)[usable] * np.log(before[usable] / after[usable])))


__all__ = ["profile_gain"]
