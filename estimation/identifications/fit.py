"""One fit with settled choices: parameters, residuals and their covariance, in passes over chunks of the logs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from operator import add
from typing import NamedTuple

import numpy as np

from estimation.estimators import Estimator, RegressionData, Solution
from estimation.identifications.choices import Choice
from estimation.regressions.braking_friction import with_braking_friction
from estimation.regressions.joint_regressor import JointRegressor
from estimation.regressions.moments import Moments
from estimation.regressions.preparation import Prepared, Rows
from estimation.uncertainty import Part, Played, batch_factors, covariance, with_repetitions
from estimation.uncertainty.averages import AVERAGING_TIME
from robots.base_parameters import BaseParameters
from robots.common.arrays import Array
from robots.common.parallel import threaded
from robots.common.stretches import ROWS_AT_A_TIME, chunks

# In a longer log, evenly spread parts represent the noise's correlation and the sandwich's inner matrix.
SANDWICH_ROWS, SANDWICH_STRETCHES = 100_000, 24


@dataclass(frozen=True, kw_only=True)
class Fit:
    """Result of a fit.

    Attributes:
        base: base parameters of the model that was fitted.
        choice: of smoothing and regularisation.
        solution: parameters and weights.
        moments: normal equations of the rows that count.
        rows: what was fitted, in order.
        torque: predicted, of all rows (N, n).
        predicted: the same, part by part.
        nominal: sum of each joint's squared errors (n,) by the robot's description, but for rows at rest; NaN without.
        covariance: of the parameters (b, b).
        white: standard errors (b,) that white noise would have.
        prior_share: share of each parameter's variance (b,) that the prior's scatter makes; None where the estimator
            states its covariance itself.
    """

    base: BaseParameters
    choice: Choice
    solution: Solution
    moments: Moments
    rows: Sequence[Rows]
    torque: Array
    predicted: Sequence[Array]
    nominal: Array
    covariance: Array
    white: Array
    prior_share: Array | None


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
    moments = sum_moments(regressor, rows).pulled(choice.prior)
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
    if "standard" not in solution.extras:
        braking = with_braking_friction(base, moments, solution.values, solution.weights, choice.ridge)
        solution = replace(solution, values=braking)
    # One array for all parts, which the estimate keeps: of millions of rows a copy counts.
    torque = np.empty((sum(len(part.motion) for part in rows), rows[0].tau.shape[1]))
    predicted = np.split(torque, np.cumsum([len(part.motion) for part in rows])[:-1])
    long = len(torque) > SANDWICH_ROWS
    passes = [second_pass(regressor, part, solution, into, long) for part, into in zip(rows, predicted, strict=True)]
    scores = np.concatenate([found.scores for found in passes])
    fitted = [Fitted(part, torque, None) for part, torque in zip(rows, predicted, strict=True)]
    if solution.row_weights is not None:
        factors = [solution.row_weights(part.tau - torque) for part, torque in zip(rows, predicted, strict=True)]
        weighted = [replace(part, mask=part.mask * factor) for part, factor in zip(rows, factors, strict=True)]
        moments = sum_moments(regressor, weighted).pulled(choice.prior)
        # An M-estimator's scores are its weights times its errors (Huber 1967).
        fitted = [Fitted(*some) for some in zip(rows, predicted, factors, strict=True)]
        scores = _scores(regressor, fitted, solution.weights) if long else scores
    averaged = round(AVERAGING_TIME / float(np.median([log.positions.period for log in logs])))
    periods = [log.period for log in logs] if whole and len(rows) == len(logs) else None
    full, white, prior_share = covariances(
        regressor, fitted, scores, moments, solution, choice.ridge, averaged, seed, periods=periods
    )
    return Fit(
        base=base,
        choice=choice,
        solution=solution,
        moments=moments,
        rows=rows,
        torque=torque,
        predicted=predicted,
        nominal=np.sum([found.nominal for found in passes], axis=0),
        covariance=full,
        white=white,
        prior_share=prior_share,
    )


def sum_moments(regressor: JointRegressor, rows: Sequence[Rows]) -> Moments:
    """Sums the normal equations of all rows, chunk by chunk on some threads."""

    def of(item: tuple[Rows, slice]) -> Moments:
        part, at = item
        motion = part.motion
        return regressor.moments(motion.q[at], motion.dq[at], motion.ddq[at], part.tau[at], part.mask[at], part.gravity)

    return reduce(add, threaded(of, ((part, at) for part in rows for at in chunks(len(part.motion)))))


class Fitted(NamedTuple):
    """Rows, the torque (N, n) that a fit predicts of them, and how much each counts (N, n), None for alike."""

    rows: Rows
    torque: Array
    factor: Array | None

    def errors(self, at: slice) -> Array:
        """Errors of some rows, zero where a row does not count."""
        errors = (self.rows.tau[at] - self.torque[at]) * self.rows.mask[at]
        return errors if self.factor is None else errors * self.factor[at]


class _Pass(NamedTuple):
    """Results of one pass over the rows, besides the predicted torque.

    Attributes:
        nominal: sum of each joint's squared errors (n,) by the robot's description.
        scores: Y' W e of the fit over each chunk (chunks, b), of the rows that count; zero where nobody asks.
    """

    nominal: Array
    scores: Array


def second_pass(regressor: JointRegressor, part: Rows, solution: Solution, torque: Array, scored: bool) -> _Pass:
    """Looks at all rows once more, now that the parameters are known, and writes the predicted torque (N, n)."""
    motion, base = part.motion, regressor.base
    described = base.from_standard(base.model.nominal)
    both = np.column_stack([solution.values, described])

    def of(at: slice) -> tuple[Array, Array]:
        nominal, score = np.empty(part.tau.shape[1]), np.zeros(base.size)
        for joint, Y in enumerate(regressor(motion.q[at], motion.dq[at], motion.ddq[at], part.gravity)):
            used = regressor.used[joint]
            fitted, expected = (Y @ both[used]).T
            torque[at, joint] = fitted
            measured = part.tau[at, joint]
            expected = measured - expected
            judged = slice(None) if part.rest is None else ~part.rest[at, joint]
            nominal[joint] = expected[judged] @ expected[judged]
            if scored:
                score[used] += ((measured - fitted) * part.mask[at, joint] * solution.weights[joint]) @ Y
        return nominal, score

    nominal, scores = zip(*threaded(of, chunks(len(motion))), strict=True)
    return _Pass(np.sum(nominal, axis=0), np.array(scores))


def covariances(
    regressor: JointRegressor,
    fitted: Sequence[Fitted],
    scores: Array,
    moments: Moments,
    solution: Solution,
    ridge: float,
    averaged: int,
    seed: int,
    rows: int | None = None,
    periods: Sequence[float | None] | None = None,
) -> tuple[Array, Array, Array | None]:
    """Covariance (b, b) by the noise and by the prior's own scatter.

    Besides it, standard errors (b,) under white noise, and the share (b,) of the variance that the prior makes.

    Args:
        regressor: of the model that was fitted.
        fitted: rows and their errors.
        scores: sums Y' W e over each chunk (chunks, b).
        moments: of all rows.
        solution: parameters and weights.
        ridge: weight of the prior.
        averaged: rows that are averaged at a time, in a long log.
        seed: of the drawn noise.
        rows: of the whole log, where `fitted` are stretches of it; None where they are all.
        periods: of the logs' motions [s], None where one does not repeat itself; None if `fitted` are not the logs.
    """
    weights = solution.weights
    inverse = moments.inverse(weights, ridge)
    assert moments.pull is not None
    held = ridge * float(weights @ moments.square) * inverse
    scatter = held @ moments.pull.precision @ held
    variance = moments.residual(solution.values) / np.maximum(moments.count, 1)
    textbook = inverse @ np.tensordot(weights**2 * variance, moments.gram, axes=1) @ inverse + scatter
    white = np.sqrt(np.maximum(np.diag(textbook), 0.0))
    if solution.covariance is not None:
        return solution.covariance, white, None
    parts = _parts(regressor, fitted)
    total = rows or sum(len(some.torque) for some in fitted)
    seen = sum(part.rows for part in parts)
    share = seen / total
    # So many averages remain at least.
    averaged = min(averaged, seen // 10_000)
    full = covariance(parts, weights, inverse, seed, share=share, averaged=averaged)
    if share < 1:
        factors = batch_factors(scores, inverse, full)
        full = full * factors[:, None] * factors
    if periods is not None:
        whole = [_part(regressor, some, 0, len(some.torque)) for some in fitted]
        played = [
            Played(some.rows.motion.t, some.rows.motion.q, period, some.rows.gravity)
            for some, period in zip(fitted, periods, strict=True)
        ]
        full = with_repetitions(full, whole, played, weights, inverse, seed, averaged)
    total_variance = np.maximum(np.diag(full + scatter), np.finfo(float).tiny)
    return full + scatter, white, np.clip(np.diag(scatter) / total_variance, 0.0, 1.0)


def _parts(regressor: JointRegressor, fitted: Sequence[Fitted]) -> list[Part]:
    """The rows as the sandwich wants them, of a long log some stretches."""
    total = sum(len(some.torque) for some in fitted)
    parts = []
    for some in fitted:
        count = len(some.torque)
        places = [(0, count)]
        if total > SANDWICH_ROWS:
            number = max(1, round(SANDWICH_STRETCHES * count / total))
            length = min(count, max(ROWS_AT_A_TIME, SANDWICH_ROWS // SANDWICH_STRETCHES))
            places = [(begin, begin + length) for begin in np.linspace(0, count - length, number).astype(int).tolist()]
        parts += [_part(regressor, some, *place) for place in places]
    return parts


def _part(joints: JointRegressor, fitted: Fitted, begin: int, end: int) -> Part:
    motion, mask, gravity = fitted.rows.motion, fitted.rows.mask[begin:end], fitted.rows.gravity

    def regressor(start: int, stop: int) -> Array:
        at = slice(begin + start, begin + stop)
        return joints.base.regressor(motion.q[at], motion.dq[at], motion.ddq[at], gravity=gravity)

    def split(start: int, stop: int) -> tuple[Array, ...]:
        at = slice(begin + start, begin + stop)
        return joints(motion.q[at], motion.dq[at], motion.ddq[at], gravity)

    def sums(start: int, stop: int, size: int) -> list[Array]:
        at = slice(begin + start, begin + stop)
        return joints.counted(motion.q[at], motion.dq[at], motion.ddq[at], mask[start:stop], size, gravity)

    return Part(end - begin, regressor, mask, fitted.errors(slice(begin, end)), joints.used, split, sums)


def _scores(regressor: JointRegressor, fitted: Sequence[Fitted], weights: Array) -> Array:
    """Sums Y' W e over each chunk (chunks, b)."""

    def of(item: tuple[Fitted, slice]) -> Array:
        some, at = item
        motion = some.rows.motion
        error = some.errors(at) * weights
        score = np.zeros(regressor.base.size)
        for joint, Y in enumerate(regressor(motion.q[at], motion.dq[at], motion.ddq[at], some.rows.gravity)):
            score[regressor.used[joint]] += error[:, joint] @ Y
        return score

    items = ((some, at) for some in fitted for at in chunks(len(some.torque)))
    return np.array(list(threaded(of, items)))
