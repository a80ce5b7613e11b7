"""One fit with settled choices: parameters, residuals and their covariance, in passes over chunks of the logs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from operator import add

import numpy as np
from numpy.typing import NDArray

from estimation.choices import Choice
from estimation.estimators import Estimator, RegressionData, Solution
from estimation.moments import Moments
from estimation.preparation import Prepared, Rows
from estimation.regression import CHUNK, JointRegressor, chunks, threaded
from estimation.uncertainty import Part, batch_factors, covariance
from robots.base_parameters import BaseParameters

Array = NDArray[np.float64]

# Standard errors are those of the fit without regularisation; this much keeps the inverse finite.
FAINT = 1e-13
# Of a longer log, evenly spread stretches stand for the colour of the noise and for the sandwich's meat.
MOST_ROWS, STRETCHES = 100_000, 24


@dataclass(frozen=True, kw_only=True)
class Fit:
    """What a fit found.

    Attributes:
        base: base parameters of the model that was fitted.
        choice: of smoothing and regularisation.
        solution: parameters and weights.
        moments: normal equations of the rows that count.
        rows: what was fitted, in order.
        predicted: torque (N, n) of each of the rows.
        covariance: of the parameters (b, b).
        white: standard errors (b,) that white noise would have.
    """

    base: BaseParameters
    choice: Choice
    solution: Solution
    moments: Moments
    rows: Sequence[Rows]
    predicted: Sequence[Array]
    covariance: Array
    white: Array


def fit(base: BaseParameters, logs: Sequence[Prepared], estimator: Estimator, choice: Choice, seed: int) -> Fit:
    """Fits with settled choices.

    Args:
        base: base parameters of the model with the chosen friction.
        logs: the data.
        estimator: what solves.
        choice: smoothing and regularisation.
        seed: of the noise drawn to correct the standard errors.
    """
    rows = [part for log in logs for part in log.pieces(choice.smoother)]
    regressor = JointRegressor(base)
    moments = sum_moments(regressor, rows).pulled(choice.pull)
    values, weights = estimator.solve(moments, choice.ridge)
    whole = len(rows) == len(logs)
    data = RegressionData(
        base=base,
        moments=moments,
        parts=rows,
        ridge=choice.ridge,
        logs=[log.log for log in logs] if whole else (),
        smoother=choice.smoother,
    )
    solution = estimator.refine(data, values, weights)
    predicted = [predict_rows(regressor, part, solution.values) for part in rows]
    errors = [(part.tau - torque) * part.mask for part, torque in zip(rows, predicted, strict=True)]
    if solution.row_weights is not None:
        factors = [solution.row_weights(part.tau - torque) for part, torque in zip(rows, predicted, strict=True)]
        weighted = [replace(part, mask=part.mask * factor) for part, factor in zip(rows, factors, strict=True)]
        moments = sum_moments(regressor, weighted).pulled(choice.pull)
        # An M-estimator's scores are its weights times its errors (Huber 1967).
        errors = [error * factor for error, factor in zip(errors, factors, strict=True)]
    full, white = _covariances(regressor, rows, errors, moments, solution, seed)
    return Fit(
        base=base,
        choice=choice,
        solution=solution,
        moments=moments,
        rows=rows,
        predicted=predicted,
        covariance=full,
        white=white,
    )


def sum_moments(regressor: JointRegressor, rows: Sequence[Rows]) -> Moments:
    """Sums the normal equations of all rows, chunk by chunk on some threads."""

    def of(item: tuple[Rows, slice]) -> Moments:
        part, at = item
        motion = part.motion
        return regressor.moments(motion.q[at], motion.dq[at], motion.ddq[at], part.tau[at], part.mask[at])

    return reduce(add, threaded(of, ((part, at) for part in rows for at in chunks(len(part.motion)))))


def predict_rows(regressor: JointRegressor, part: Rows, values: Array) -> Array:
    """Predicts the torque (N, n) of rows by base parameters (b,)."""
    motion = part.motion
    torque = np.empty_like(part.tau)

    def of(at: slice) -> None:
        torque[at] = regressor.torque(motion.q[at], motion.dq[at], motion.ddq[at], values)

    for _ in threaded(of, chunks(len(motion))):
        pass
    return torque


def _covariances(
    regressor: JointRegressor,
    rows: Sequence[Rows],
    errors: Sequence[Array],
    moments: Moments,
    solution: Solution,
    seed: int,
) -> tuple[Array, Array]:
    weights = solution.weights
    inverse = moments.inverse(weights, FAINT)
    variance = moments.residual(solution.values) / np.maximum(moments.count, 1)
    textbook = inverse @ np.tensordot(weights**2 * variance, moments.gram, axes=1) @ inverse
    white = np.sqrt(np.maximum(np.diag(textbook), 0.0))
    if solution.covariance is not None:
        return solution.covariance, white
    parts = _parts(regressor, rows, errors)
    total = sum(len(part.motion) for part in rows)
    share = sum(part.rows for part in parts) / total
    full = covariance(parts, weights, inverse, seed, share=share)
    if share < 1:
        factors = batch_factors(_scores(regressor, rows, errors, weights), inverse, full)
        full = full * factors[:, None] * factors
    return full, white


def _parts(regressor: JointRegressor, rows: Sequence[Rows], errors: Sequence[Array]) -> list[Part]:
    """The rows as the sandwich wants them, of a long log some stretches."""
    total = sum(len(part.motion) for part in rows)
    parts = []
    for part, error in zip(rows, errors, strict=True):
        count = len(part.motion)
        places = [(0, count)]
        if total > MOST_ROWS:
            number = max(1, round(STRETCHES * count / total))
            length = min(count, max(CHUNK, MOST_ROWS // STRETCHES))
            places = [(begin, begin + length) for begin in np.linspace(0, count - length, number).astype(int).tolist()]
        parts += [_part(regressor, part, error, *place) for place in places]
    return parts


def _part(joints: JointRegressor, part: Rows, error: Array, begin: int, end: int) -> Part:
    motion, mask = part.motion, part.mask[begin:end]

    def regressor(start: int, stop: int) -> Array:
        at = slice(begin + start, begin + stop)
        return joints.base.regressor(motion.q[at], motion.dq[at], motion.ddq[at])

    def split(start: int, stop: int) -> tuple[Array, ...]:
        at = slice(begin + start, begin + stop)
        return joints(motion.q[at], motion.dq[at], motion.ddq[at])

    return Part(end - begin, regressor, mask, error[begin:end], joints.used, split)


def _scores(regressor: JointRegressor, rows: Sequence[Rows], errors: Sequence[Array], weights: Array) -> Array:
    """Sums Y' W e over each chunk (chunks, b)."""

    def of(item: tuple[Rows, Array, slice]) -> Array:
        part, residual, at = item
        motion = part.motion
        error = residual[at] * weights
        score = np.zeros(regressor.base.size)
        for joint, Y in enumerate(regressor(motion.q[at], motion.dq[at], motion.ddq[at])):
            score[regressor.used[joint]] += error[:, joint] @ Y
        return score

    items = ((p, error, at) for p, error in zip(rows, errors, strict=True) for at in chunks(len(p.motion)))
    return np.array(list(threaded(of, items)))
