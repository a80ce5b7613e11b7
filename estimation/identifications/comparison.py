"""Settings against each other: left-out errors on the same blocks of the same logs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimation.estimators import Estimator
from estimation.identifications.trials import Candidates, Trial, smallest, strongest
from estimation.preprocessing import Harmonics, LowPass, Smoother, SmoothingSpline
from estimation.regressions.blocks import Blocks, Sides, side_products
from estimation.regressions.joint_regressor import JointRegressor, summed
from estimation.regressions.parameter_priors import GaussianPrior, friction_levels, prior_from_description
from estimation.regressions.preparation import Prepared, Rows, rows_of
from robots.base_parameters import BaseParameters

Array = NDArray[np.float64]

# tanh(dq / v0): the first is the sign in practice, and stays unless the data ask for a wider one.
VELOCITY_SCALES = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1)
WIDER = np.array(VELOCITY_SCALES[1:])
# Share of its residual that a wider sign must save a joint. Cross-validation would prefer wide ones even where the
# truth is a sign, and bias the friction by many standard errors.
SAVING = 0.03
# How much worse, in mean log error, a lower cut-off may be and still be taken.
CUTOFF_SLACK = 0.0005
# Required gain of another smoother over the low-pass, or of a prior over none.
SMOOTHER_GAIN, PULL_GAIN = 0.005, 0.03
# Largest allowed loss of a single joint by a prior (log error).
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
        self._latest: tuple[Smoother, list[Rows]] | None = None
        count = sum(len(log.log) for log in logs)
        tau = np.concatenate([log.tau for log in logs]) if len(logs) > 1 else logs[0].tau
        self.spread = np.maximum(tau.std(axis=0), 1e-9 * np.maximum(1.0, np.abs(tau).max(axis=0)))
        self.sampled = count > MOST_ROWS
        self.logs: list[Prepared] = []
        for log in logs:
            number = max(1, round(STRETCHES * len(log.log) / count)) if self.sampled else 1
            self.logs += log.stretches(number, -(-min(len(log.log), round(MOST_ROWS / count * len(log.log))) // number))
        self.period = float(np.median([log.positions.period for log in self.logs]))
        self.fastest = np.max([_fastest(log) for log in self.logs], axis=0)
        kept = sum(len(log.log) for log in self.logs)
        self.averaged = max(1, min(round(AVERAGED / self.period), kept // LEAST_AVERAGES))

    def smoother(self) -> Smoother:
        """Chooses the smoothing, by some settings of the regularisation."""
        rate = 1 / self.period
        usable = [cutoff for cutoff in self.candidates.cutoffs if cutoff <= 0.4 * rate] or [0.4 * rate]
        # All of them: an elastic drive makes a second minimum far above the first.
        tried = [(cutoff, self._best(self.blocks(LowPass(cutoff)))) for cutoff in usable]
        lowest = min(cost for _, cost in tried)
        cutoff, cost = min((t for t in tried if t[1] <= lowest + CUTOFF_SLACK), key=lambda t: t[0])
        chosen: Smoother = LowPass(cutoff)
        for other in self._others(cutoff):
            found = self._best(self.blocks(other))
            if found < cost - SMOOTHER_GAIN:
                chosen, cost = other, found
        return chosen

    def regularisation(self, blocks: Sides) -> tuple[Trial, Trial]:
        """Chooses prior and ridge: the description if it clearly helps, otherwise zero.

        Returns:
            The trial with the smallest ridge and no prior, and the chosen one.
        """
        ridges = sorted(self.candidates.ridges)
        tried = [self._try(blocks, ridge, None) for ridge in ridges]
        pull = self._description(blocks)
        if pull is not None:
            pulled = [self._try(blocks, ridge, pull) for ridge in ridges]
            # No joint pays for the others: small torques are lost in a mean that big ones gain.
            fair = [trial for trial in pulled if (trial.logs <= tried[0].logs + UNFAIR).all()]
            if fair and min(trial.cost for trial in fair) < tried[0].cost - PULL_GAIN:
                return tried[0], strongest(fair)
        return tried[0], smallest(tried)

    def blocks(self, smoother: Smoother, averaged: int | None = None) -> Sides:
        """Normal equations of each block, the sign columns of the wider scales appended after the base columns."""
        size = averaged or self.averaged
        pieces = [(part, piece) for part in self._rows(smoother) for piece in self._pieces(part)]
        sides = Sides.empty(len(self.spread), len(pieces), self.base.size + len(self.spread) * len(WIDER))
        # One after the other: what is done with a piece is so short that threads wait for each other.
        for block, (part, piece) in enumerate(pieces):
            self._fill(sides, block, part, piece, size)
        return sides

    def _rows(self, smoother: Smoother) -> list[Rows]:
        """All rows of each log; the latest are kept, which the chosen smoothing is asked for more than once.

        The ends of a log are predicted as well as the rest; those of a stretch of a long one are of our making.
        """
        if self._latest is None or self._latest[0] != smoother:
            self._latest = smoother, rows_of(self.logs, smoother, ends=not self.sampled)
        return self._latest[1]

    def _fill(self, sides: Sides, block: int, part: Rows, piece: slice, size: int) -> None:
        """Sums the normal equations of one block: of the rows that count in a fit, and of all rows."""
        rows = piece.stop - piece.start
        whole = rows // size * size
        place = slice(piece.start, piece.start + (whole or rows))
        size = size if whole else rows
        motion, mask, tau = part.motion, part.mask[place], np.ascontiguousarray(part.tau[place].T)
        signals = motion.q[place], motion.dq[place], motion.ddq[place]
        all_sums = self.regressor.sums(*signals, size, part.gravity)
        # Few rows do not count in full: their columns are asked for once more.
        slow = np.flatnonzero((mask != 1).any(axis=1))
        q, dq, ddq = (signal[slow] for signal in signals)
        slow_rows = self.regressor(q, dq, ddq, part.gravity)
        missing, speeds = 1 - mask[slow].T, np.ascontiguousarray(signals[1].T)
        groups, ones = len(mask) // size, np.ones(size)
        held = np.zeros(len(missing), dtype=bool) if part.held is None else part.held
        for joint, (sums, some, used) in enumerate(zip(all_sums, slow_rows, self.regressor.used, strict=True)):
            if held[joint]:
                continue
            wide = np.tanh(speeds[joint] / WIDER[:, None])
            count = len(used)
            rows = np.empty((groups, count + len(WIDER) + 1))
            rows[:, :count] = sums
            # A product: numpy's own sum along so short an axis takes four times as long.
            rows[:, count:-1] = (wide.reshape(-1, size) @ ones).reshape(len(WIDER), groups).T
            rows[:, -1] = tau[joint].reshape(groups, size) @ ones
            own = np.flatnonzero(missing[joint])
            at = slow[own]
            lost = np.column_stack([some[own], wide[:, at].T, tau[joint, at]]) * missing[joint, own, None]
            places, lost = summed(lost, at // size)
            products = side_products(rows, lost, places, size)
            chosen = np.concatenate([used, self.base.size + joint * len(WIDER) + np.arange(len(WIDER))])
            for side, product in zip((sides.fitted, sides.judged), products, strict=True):
                side.gram[joint, block][np.ix_(chosen, chosen)] = product[:-1, :-1]
                side.cross[joint, block, chosen] = product[:-1, -1]
                side.square[joint, block] = product[-1, -1]
        sides.fitted.count[:, block] = mask.sum(axis=0) / size
        sides.judged.count[~held, block] = len(mask) / size

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

    def _best(self, blocks: Sides) -> float:
        ridges = sorted(self.candidates.ridges)
        middle = ridges[len(ridges) // 2]
        settings = [(ridges[0], None), (middle, None), (middle, self._description(blocks))]
        return min(self._try(blocks, *setting).cost for setting in settings)

    def _try(self, blocks: Sides, ridge: float, pull: GaussianPrior | None) -> Trial:
        trial = Trial(ridge, pull, tuple(self._scales(blocks, ridge, pull)), np.zeros(0))
        return replace(trial, logs=np.log(np.maximum(self.left_out(blocks, trial) / self.spread, EXACT)))

    def left_out(self, blocks: Sides, trial: Trial) -> Array:
        """RMS error of all rows of each block, predicted from the others (n,) [N m or N]."""
        columns = self._columns(trial.scales).tolist()
        judged = blocks.judged.columns(columns)
        squares = judged.squares(self._without(blocks.fitted.columns(columns), trial))
        return np.asarray(np.sqrt(squares / np.maximum(judged.count.sum(axis=1), 1)))

    def _without(self, chosen: Blocks, trial: Trial) -> Array:
        """Parameters (B, b) of the fit without each block."""
        _, weights = self.estimator.solve(chosen.total.pulled(trial.pull), trial.ridge)
        return chosen.without(weights, trial.ridge, trial.pull)

    def band(self, smoother: Smoother, blocks: Sides, trial: Trial) -> tuple[Array, Array]:
        """Half-width (n,) that contains `BAND` of the held-out errors, and its coverage on other blocks (n,).

        Each block's coverage is counted with the quantile of the other blocks' errors, as for a new motion of the same
        kind (a split conformal interval, block by block).
        """
        values = iter(self._without(blocks.fitted.columns(self._columns(trial.scales).tolist()), trial))
        rows = self._rows(smoother)
        errors = [np.abs(error) for part in rows for error in self._errors(part, trial.scales, values)]
        # Errors of joints at rest in a block are unknown.
        told = np.array([~np.isnan(error[0]) for error in errors])
        levels = np.array([band_of(error) for error in errors])
        whole = band_of(np.concatenate(errors))
        if len(errors) == 1:
            return whole, np.full(len(whole), np.nan)
        shares, count = np.zeros((2, len(whole)))
        for k, error in enumerate(errors):
            if len(errors) <= FEW:
                level = band_of(np.concatenate(errors[:k] + errors[k + 1 :]))
            else:
                others = np.delete(told, k, 0)
                known = np.where(others, np.delete(levels, k, 0), 0.0).sum(axis=0)
                level = known / np.maximum(others.sum(axis=0), 1)
            shares += np.where(told[k], (error <= level).sum(axis=0), 0.0)
            count += told[k] * len(error)
        return whole, np.where(count > 0, shares / np.maximum(count, 1), np.nan)

    def _errors(self, part: Rows, scales: Sequence[int], values: Iterator[Array]) -> Iterator[Array]:
        """Errors (N, n) of each block of a log by the next of the values."""
        motion = part.motion
        for piece in self._pieces(part):
            rows = self.regressor(motion.q[piece], motion.dq[piece], motion.ddq[piece], part.gravity)
            parameters = next(values)
            error = part.tau[piece].copy()
            for joint, (Y, used) in enumerate(zip(rows, self.regressor.used, strict=True)):
                if scales[joint]:
                    sign = [i for i, k in enumerate(used) if self._is_sign(int(k), joint)]
                    Y[:, sign] = np.tanh(motion.dq[piece, joint, None] / VELOCITY_SCALES[scales[joint]])
                error[:, joint] -= Y @ parameters[used]
            if part.held is not None:
                error[:, part.held] = np.nan
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

    def _scales(self, blocks: Sides, ridge: float, pull: GaussianPrior | None) -> list[int]:
        """Per joint the index of its velocity scale: the widest saving, if it is worth it."""
        total = blocks.fitted.total
        choices = np.array([self._columns([k] * len(total.count)) for k in range(len(VELOCITY_SCALES))])
        errors = np.array([total.residual(values) for values in blocks.fitted.fitted(choices, ridge, pull)])
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

    def _description(self, blocks: Sides) -> GaussianPrior | None:
        if not self.candidates.pull:
            return None
        total = blocks.fitted.total
        count = np.maximum(total.count, 1)
        own = [column.joint - 1 for column in self.base.columns]
        squares = np.array([total.gram[joint, i, i] / count[joint] for i, joint in enumerate(own)])
        level = friction_levels(self.base, np.sqrt(squares), self.fastest)
        return prior_from_description(self.base, np.sqrt(total.square / count), level)


def band_of(errors: Array) -> Array:
    """Gives the half-widths (n,) that hold `BAND` of each joint's errors (N, n) that are known; NaN where none is."""
    if not np.isnan(errors).any():
        return np.asarray(np.quantile(errors, BAND, axis=0))
    known = (column[~np.isnan(column)] for column in errors.T)
    return np.array([np.quantile(column, BAND) if len(column) else np.nan for column in known])
