"""What an effect explains where the noise was estimated with it, and some logs are quieter than others."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import FittedEffect

Array = NDArray[np.float64]

# Energy of white rows of unit noise: a low-pass leaves so much of each.
PASSED = 0.64


def profile_gain(problem: Problem, member: FittedEffect) -> float:
    """Gives twice the logarithm of an effect's likelihood ratio, the noise of each log free.

    The gain of a `FittedEffect` counts in units of a noise that all logs share and that was estimated before the effect
    was known. In a log that the effect rules (a hand moves the arm, its motors only carry it), that is no noise but the
    effect. With the level of each log profiled out, the ratio is sum_r N_r log(E_r / E_r'), E the squared residual of
    log r without the effect and with it, N_r its white rows less what was fitted to them. Where effects are small
    beside the noise, both are the same.

    Args:
        problem: the data and base model.
        member: an effect, measured beside the base model alone.
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
