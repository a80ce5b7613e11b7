"""Settings against each other: left-out errors on the same blocks of the same logs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from itertools import pairwise
from operator import add

import numpy as np
from numpy.typing import NDArray

from estimation.estimators import Estimator
from estimation.moments import Moments
from estimation.preparation import Prepared, Rows
from estimation.preprocessing import Harmonics, LowPass, Smoother, SmoothingSpline
from estimation.pulls import Pull, description_pull, friction_levels
from estimation.regression import JointRegressor, threaded
from robots.base_parameters import BaseParameters

Array = NDArray[np.float64]

# tanh(dq / v0): the first is the sign in practice, and stays unless the data ask for a wider one.
VELOCITY_SCALES = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1)
# Share of its residual that a wider sign must save a joint. Cross-validation would prefer wide ones even where the
# truth is a sign, and bias the friction by many standard errors.
SAVING = 0.03
# How much worse, in mean log error, a smaller ridge or a lower cut-off may be and still be taken.
RIDGE_SLACK, CUTOFF_SLACK = 0.01, 0.0005
# How much better another smoother or a pull towards the description must be than the low-pass and none.
SMOOTHER_GAIN, PULL_GAIN = 0.005, 0.03
# How much worse, in log error, a single joint may become by a pull.
UNFAIR = 0.25
# Share of the errors that a band is to hold, and up to how many blocks each gets the quantile of all others.
BAND, FEW = 0.95, 24
# More harmonics than a motion of an arm has cost the square of their number.
MOST_HARMONICS = 120
# A left-out error below this share of a constant's is rounding.
EXACT = 1e-9
# More rows than this do not choose better, only slower: evenly spread stretches then stand for the log.
MOST_ROWS, STRETCHES = 24_000, 10
# Both sides are averaged over so much time [s], which leaves the noise above 25 Hz out of the comparison, ...
AVERAGED = 0.02
# ... as long as so many averages remain.
LEAST_AVERAGES = 400


@dataclass(frozen=True, kw_only=True)
class Candidates:
    """What to choose from.

    Attributes:
        cutoffs: of the smoothing [Hz]; those above 0.4 of the sampling rate are left out.
        ridges: see `Moments.solve`.
        blocks: contiguous pieces of the logs, each predicted from the others.
        smoothers: which smoothers besides the low-pass: ``spline``, and ``harmonics`` where the motion is periodic.
        pull: whether the regularisation may pull towards the robot's description.
        period: of the motion [s] where it is known; None leaves it to the log.
    """

    cutoffs: tuple[float, ...] = (1.5, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0, 30.0, 50.0)
    ridges: tuple[float, ...] = (1e-8, 1e-7, 1e-6, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 1e-2)
    blocks: int = 10
    smoothers: tuple[str, ...] = ("spline", "harmonics")
    pull: bool = True
    period: float | None = None


@dataclass(frozen=True)
class Trial:
    """One setting: its ridge and pull, each joint's index into the velocity scales, and its left-out errors."""

    ridge: float
    pull: Pull | None
    scales: tuple[int, ...]
    logs: Array  # of the errors (n,) relative to a constant

    @property
    def cost(self) -> float:
        """Mean log of the errors relative to a constant, a joint worse than a constant counting as one."""
        return float(np.minimum(self.logs, 0.0).mean())


def _smallest(trials: Sequence[Trial]) -> Trial:
    """The smallest ridge that is as good as the best; the trials come with ascending ridges."""
    best = min(trial.cost for trial in trials)
    return next(trial for trial in trials if trial.cost <= best + RIDGE_SLACK)


def _fastest(log: Prepared) -> Array:
    """Speed (n,) that a joint exceeds in a thousandth of the time only: noise makes single larger ones."""
    grid = log.positions
    span = max(1, round(AVERAGED / grid.period))
    return np.asarray(np.quantile(np.abs(grid.q[span:] - grid.q[:-span]), 0.999, axis=0) / (span * grid.period))


class Comparison:
    """Settings against each other on the same data."""

    def __init__(
        self, base: BaseParameters, logs: Sequence[Prepared], estimator: Estimator, candidates: Candidates
    ) -> None:
        self.base, self.estimator, self.candidates = base, estimator, candidates
        self.regressor = JointRegressor(base)
        count = sum(len(log.log) for log in logs)
        tau = np.concatenate([log.tau for log in logs]) if len(logs) > 1 else logs[0].tau
        self.spread = np.maximum(tau.std(axis=0), 1e-9 * np.maximum(1.0, np.abs(tau).max(axis=0)))
        self.logs: list[Prepared] = []
        for log in logs:
            number = max(1, round(STRETCHES * len(log.log) / count)) if count > MOST_ROWS else 1
            self.logs += log.stretches(number, -(-min(len(log.log), round(MOST_ROWS / count * len(log.log))) // number))
        self.period = float(np.median([log.positions.period for log in self.logs]))
        self.fastest = np.max([_fastest(log) for log in self.logs], axis=0)
        kept = sum(len(log.log) for log in self.logs)
        self.averaged = max(1, min(round(AVERAGED / self.period), kept // LEAST_AVERAGES))

    def smoother(self) -> tuple[Smoother, list[Moments]]:
        """Chooses the smoothing, by some settings of the regularisation, and gives its blocks."""
        rate = 1 / self.period
        usable = [cutoff for cutoff in self.candidates.cutoffs if cutoff <= 0.4 * rate] or [0.4 * rate]
        # All of them: an elastic drive makes a second minimum far above the first.
        tried = [(cutoff, blocks, self._best(blocks)) for cutoff in usable for blocks in [self.blocks(LowPass(cutoff))]]
        lowest = min(cost for _, _, cost in tried)
        cutoff, blocks, cost = min((t for t in tried if t[2] <= lowest + CUTOFF_SLACK), key=lambda t: t[0])
        chosen: Smoother = LowPass(cutoff)
        for other in self._others(cutoff):
            found = self.blocks(other)
            if self._best(found) < cost - SMOOTHER_GAIN:
                chosen, blocks, cost = other, found, self._best(found)
        return chosen, blocks

    def regularisation(self, blocks: list[Moments]) -> tuple[Trial, Trial]:
        """Chooses pull and ridge: towards the description where that clearly helps, else to zero as far as it helps.

        Returns:
            The trial with the smallest ridge and no pull, and the chosen one.
        """
        ridges = sorted(self.candidates.ridges)
        tried = [self._try(blocks, ridge, None) for ridge in ridges]
        pull = self._description(blocks)
        if pull is not None:
            pulled = [self._try(blocks, ridge, pull) for ridge in ridges]
            # No joint pays for the others: small torques are lost in a mean that big ones gain.
            fair = [trial for trial in pulled if (trial.logs <= tried[0].logs + UNFAIR).all()]
            if fair and min(trial.cost for trial in fair) < tried[0].cost - PULL_GAIN:
                return tried[0], _smallest(fair)
        return tried[0], _smallest(tried)

    def blocks(self, smoother: Smoother, averaged: int | None = None) -> list[Moments]:
        """Moments of each block, the sign columns of the wider scales appended after the base columns."""
        size = averaged or self.averaged

        def of(log: Prepared) -> list[Moments]:
            part = log.rows(smoother)
            return [self._moments(part, piece, size) for piece in self._pieces(part)]

        return [block for found in threaded(of, self.logs) for block in found]

    def _moments(self, part: Rows, piece: slice, size: int) -> Moments:
        rows = piece.stop - piece.start
        whole = rows // size * size
        place = slice(piece.start, piece.start + (whole or rows))
        size = size if whole else rows
        motion, mask = part.motion, part.mask[place]
        dq = motion.dq[place]
        n, extra = motion.n, len(VELOCITY_SCALES) - 1
        columns = self.base.size + n * extra
        gram, cross, square, count = np.zeros((n, columns, columns)), np.zeros((n, columns)), np.zeros(n), np.zeros(n)
        joints = zip(self.regressor(motion.q[place], dq, motion.ddq[place]), self.regressor.used, strict=True)
        for joint, (own, used) in enumerate(joints):
            wide = np.tanh(dq[:, joint, None] / np.array(VELOCITY_SCALES[1:]))
            Y = np.hstack([own, wide, part.tau[place, joint, None]]) * mask[:, joint, None]
            if size > 1:
                # Rows that do not count are zero on both sides: what is left is still an equation.
                Y = Y.reshape(-1, size, Y.shape[1]).mean(axis=1)
            products = Y.T @ Y
            chosen = np.concatenate([used, self.base.size + joint * extra + np.arange(extra)])
            gram[joint][np.ix_(chosen, chosen)] = products[:-1, :-1]
            cross[joint, chosen] = products[:-1, -1]
            square[joint] = products[-1, -1]
            count[joint] = mask[:, joint].sum() / size
        return Moments(gram, cross, square, count)

    def _others(self, cutoff: float) -> list[Smoother]:
        """Smoothers of other kinds and about that cut-off."""
        others: list[Smoother] = []
        if "spline" in self.candidates.smoothers:
            others.append(SmoothingSpline(cutoff))
        if "harmonics" in self.candidates.smoothers:
            periods = [self.candidates.period or log.period for log in self.logs]
            known = [period for period in periods if period]
            # One period for all: logs that repeat differently, or not at all, have none in common.
            if len(known) == len(periods) and np.ptp(known) < 1e-3 * min(known):
                period = float(np.mean(known))
                orders = sorted(
                    {min(max(1, round(factor * cutoff * period)), MOST_HARMONICS) for factor in (0.5, 1.0, 2.0)}
                )
                others += [Harmonics(period, order) for order in orders if order / period < 0.4 / self.period]
        return others

    def _best(self, blocks: list[Moments]) -> float:
        ridges = sorted(self.candidates.ridges)
        middle = ridges[len(ridges) // 2]
        settings = [(ridges[0], None), (middle, None), (middle, self._description(blocks))]
        return min(self._try(blocks, *setting).cost for setting in settings)

    def _try(self, blocks: list[Moments], ridge: float, pull: Pull | None) -> Trial:
        total = reduce(add, blocks)
        sharp = total.columns(np.arange(self.base.size)).pulled(pull)
        trial = Trial(ridge, pull, tuple(self._scales(total, sharp, ridge)), np.zeros(0))
        return replace(trial, logs=np.log(np.maximum(self.left_out(blocks, trial) / self.spread, EXACT)))

    def left_out(self, blocks: list[Moments], trial: Trial) -> Array:
        """RMS error of each block predicted from the others (n,) [N m or N]."""
        columns = self._columns(trial.scales)
        parts = [block.columns(columns).pulled(trial.pull) for block in blocks]
        total = reduce(add, parts)
        _, weights = self.estimator.solve(total, trial.ridge)
        error = np.zeros_like(self.spread)
        for part in parts:
            rest = total - part if len(parts) > 1 else total
            error += part.residual(rest.solve(weights, trial.ridge))
        return np.sqrt(error / np.maximum(total.count, 1))

    def band(self, smoother: Smoother, blocks: list[Moments], trial: Trial) -> tuple[Array, Array]:
        """Half-width (n,) that holds `BAND` of the left-out errors, and the share that it holds on unseen blocks (n,).

        Each block's share is counted with the quantile of the other blocks' errors: what a user sees who takes the
        band to a motion of the same kind (a split conformal interval, block by block).
        """
        columns = self._columns(trial.scales)
        parts = [block.columns(columns).pulled(trial.pull) for block in blocks]
        total = reduce(add, parts)
        _, weights = self.estimator.solve(total, trial.ridge)
        left = (total - part if len(parts) > 1 else total for part in parts)
        values = (rest.solve(weights, trial.ridge) for rest in left)
        errors = [np.abs(error) for log in self.logs for error in self._errors(log, smoother, trial.scales, values)]
        levels = np.array([np.quantile(error, BAND, axis=0) for error in errors])
        whole = np.quantile(np.concatenate(errors), BAND, axis=0)
        if len(errors) == 1:
            return whole, np.full(len(whole), np.nan)
        shares = []
        for k, error in enumerate(errors):
            others = np.concatenate(errors[:k] + errors[k + 1 :]) if len(errors) <= FEW else None
            level = np.quantile(others, BAND, axis=0) if others is not None else np.delete(levels, k, 0).mean(axis=0)
            shares.append((error <= level).mean(axis=0) * len(error))
        return whole, np.asarray(np.sum(shares, axis=0) / sum(len(error) for error in errors))

    def _errors(
        self, log: Prepared, smoother: Smoother, scales: Sequence[int], values: Iterator[Array]
    ) -> Iterator[Array]:
        """Errors (N, n) of each block of a log by the next of the values."""
        part = log.rows(smoother)
        motion = part.motion
        for piece in self._pieces(part):
            rows = self.regressor(motion.q[piece], motion.dq[piece], motion.ddq[piece])
            parameters = next(values)
            error = part.tau[piece].copy()
            for joint, (Y, used) in enumerate(zip(rows, self.regressor.used, strict=True)):
                if scales[joint]:
                    sign = [i for i, k in enumerate(used) if self._is_sign(int(k), joint)]
                    Y[:, sign] = np.tanh(motion.dq[piece, joint, None] / VELOCITY_SCALES[scales[joint]])
                error[:, joint] -= Y @ parameters[used]
            yield error

    def _is_sign(self, column: int, joint: int) -> bool:
        described = self.base.columns[column]
        return described.symbol == "f1" and described.joint == joint + 1

    def _pieces(self, part: Rows) -> list[slice]:
        """Cuts a stretch's rows into blocks."""
        rows = sum(len(log.log) for log in self.logs)
        pieces = max(1, round(self.candidates.blocks * len(part.motion) / rows))
        bounds = np.linspace(0, len(part.motion), pieces + 1).astype(int).tolist()
        return [slice(first, stop) for first, stop in pairwise(bounds)]

    def _scales(self, total: Moments, sharp: Moments, ridge: float) -> list[int]:
        """Per joint the index of its velocity scale: the widest saving, if it is worth it."""
        joints = len(total.count)
        errors = np.empty((len(VELOCITY_SCALES), joints))
        for k in range(len(VELOCITY_SCALES)):
            moments = total.columns(self._columns([k] * joints)).pulled(sharp.pull) if k else sharp
            errors[k] = moments.residual(moments.solve(np.ones(joints), ridge))
        worth = errors.min(axis=0) < (1 - SAVING) ** 2 * errors[0]
        return [int(k) if yes else 0 for k, yes in zip(errors.argmin(axis=0), worth, strict=True)]

    def _columns(self, scales: Sequence[int]) -> NDArray[np.intp]:
        chosen = np.arange(self.base.size)
        extra = len(VELOCITY_SCALES) - 1
        for position, column in enumerate(self.base.columns):
            scale = scales[column.joint - 1] if column.symbol == "f1" else 0
            if scale:
                chosen[position] = self.base.size + (column.joint - 1) * extra + scale - 1
        return chosen

    def _description(self, blocks: list[Moments]) -> Pull | None:
        if not self.candidates.pull:
            return None
        total = reduce(add, blocks)
        count = np.maximum(total.count, 1)
        own = [column.joint - 1 for column in self.base.columns]
        squares = np.array([total.gram[joint, i, i] / count[joint] for i, joint in enumerate(own)])
        level = friction_levels(self.base, np.sqrt(squares), self.fastest)
        return description_pull(self.base, np.sqrt(total.square / count), level)
