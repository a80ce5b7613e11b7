"""Settings against each other: left-out errors on the same blocks of the same logs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimation.estimators import Estimator
from estimation.identifications.trials import Candidates, Trial
from estimation.preprocessing import Harmonics, LowPass, Smoother, SmoothingSpline
from estimation.regressions.blocks import Blocks, Sides, side_products
from estimation.regressions.default_prior import MODEL_ERROR_MEMORY, default_prior, weighed_prior
from estimation.regressions.joint_regressor import JointRegressor, summed
from estimation.regressions.parameter_priors import GaussianPrior
from estimation.regressions.preparation import Prepared, Rows, rows_of
from estimation.regressions.standard_parameters import column_levels
from estimation.uncertainty.averages import AVERAGING_TIME
from robots.base_parameters import BaseParameters
from robots.common.arrays import Array
from robots.terms import PositionTorque

# tanh(dq / v0): the first is the sign in practice, and stays unless the data ask for a wider one.
VELOCITY_SCALES = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1)
WIDER = np.array(VELOCITY_SCALES[1:])
# More rows than this do not choose better, only slower: evenly spread stretches then stand for the log.
COMPARED_ROWS, COMPARED_STRETCHES = 24_000, 10


class Comparison:
    """Settings against each other on the same data."""

    def __init__(
        self,
        base: BaseParameters,
        logs: Sequence[Prepared],
        estimator: Estimator,
        candidates: Candidates,
        spread: Array | None = None,
    ) -> None:
        self.base, self.estimator, self.candidates = base, estimator, candidates
        self.regressor = JointRegressor(base)
        self._latest: tuple[Smoother, list[Rows]] | None = None
        count = sum(len(log.log) for log in logs)
        tau = np.concatenate([log.tau for log in logs]) if len(logs) > 1 else logs[0].tau
        deviation = tau.std(axis=0) if spread is None else spread
        self.spread = np.maximum(deviation, 1e-9 * np.maximum(1.0, np.abs(tau).max(axis=0)))
        self.sampled = count > COMPARED_ROWS or spread is not None
        self.logs: list[Prepared] = []
        self.names = [log.log.name or f"log {index}" for index, log in enumerate(logs, start=1)]
        self.source: list[int] = []  # of each stretch, which log it is part of
        for index, log in enumerate(logs):
            number = max(1, round(COMPARED_STRETCHES * len(log.log) / count)) if self.sampled else 1
            self.logs += log.stretches(
                number, -(-min(len(log.log), round(COMPARED_ROWS / count * len(log.log))) // number)
            )
            self.source += [index] * (len(self.logs) - len(self.source))
        self.period = float(np.median([log.positions.period for log in self.logs]))
        kept = sum(len(log.log) for log in self.logs)
        # So many averages remain at least.
        self.averaged = max(1, min(round(AVERAGING_TIME / self.period), kept // 400))
        self.plain = np.flatnonzero([column.term != PositionTorque.name for column in base.columns])

    def smoother(self) -> tuple[Smoother, LowPass]:
        """Chooses the smoothing; and the best low-pass, which suits other motions of the same sensors, too."""
        rate = 1 / self.period
        usable = [cutoff for cutoff in self.candidates.cutoffs if cutoff <= 0.4 * rate] or [0.4 * rate]
        # All of them: an elastic drive makes a second minimum far above the first.
        tried = [(cutoff, self.trial(self.blocks(LowPass(cutoff))).cost) for cutoff in usable]
        lowest = min(cost for _, cost in tried)
        # How much worse, in mean log error, a lower cut-off may be and still be taken.
        cutoff, cost = min((t for t in tried if t[1] <= lowest + 0.0005), key=lambda t: t[0])
        low_pass = LowPass(cutoff)
        chosen: Smoother = low_pass
        for other in self._others(cutoff):
            found = self.trial(self.blocks(other)).cost
            # Required gain of another smoother over the low-pass.
            if found < cost - 0.005:
                chosen, cost = other, found
        return chosen, low_pass

    def trial(self, blocks: Sides, *, position: bool = False) -> Trial:
        """Gives the setting of blocks of averaged rows, with a torque by each joint's position or without."""
        columns = np.arange(self.base.size) if position else self.plain
        moments = blocks.fitted.columns(columns.tolist()).total
        prior = self._prior(blocks).columns(columns)
        rows = max(1.0, MODEL_ERROR_MEMORY / (self.period * self.averaged))
        ridge, prior = weighed_prior(self.estimator.solve, moments, prior, rows)
        trial = Trial(ridge, prior, tuple(columns.tolist()), self._scales(blocks, columns, ridge, prior), np.zeros(0))
        # A left-out error below this share of a constant's is rounding.
        return replace(trial, logs=np.log(np.maximum(self.left_out(blocks, trial) / self.spread, 1e-9)))

    def blocks(self, smoother: Smoother, averaged: int | None = None) -> Sides:
        """Normal equations of each block, the sign columns of the wider scales appended after the base columns.

        Args:
            smoother: of the positions.
            averaged: so many rows are averaged at a time; by default those of 20 ms.
        """
        size = averaged or self.averaged
        pieces = [(part, piece) for part in self.rows(smoother) for piece in self.pieces(part)]
        sides = Sides.empty(len(self.spread), len(pieces), self.base.size + len(self.spread) * len(WIDER))
        # One after the other: what is done with a piece is so short that threads wait for each other.
        for block, (part, piece) in enumerate(pieces):
            self._fill(sides, block, part, piece, size)
        return sides

    def rows(self, smoother: Smoother) -> list[Rows]:
        """All rows of each log; the latest are kept, which the chosen smoothing is asked for more than once.

        The ends of a log are predicted as well as the rest; those of a stretch of a long one are of our making.
        """
        if self._latest is None or self._latest[0] != smoother:
            self._latest = smoother, rows_of(self.logs, smoother, ends=not self.sampled)
        return self._latest[1]

    def _fill(self, sides: Sides, block: int, part: Rows, piece: slice, size: int) -> None:
        """Sums the normal equations of one block: of the rows that count in a fit, and of all that are judged."""
        rows = piece.stop - piece.start
        whole = rows // size * size
        place = slice(piece.start, piece.start + (whole or rows))
        size = size if whole else rows
        motion, mask, tau = part.motion, part.mask[place], np.ascontiguousarray(part.tau[place].T)
        signals = motion.q[place], motion.dq[place], motion.ddq[place]
        all_sums = self.regressor.sums(*signals, size, part.gravity)
        judged = part.judged[place]
        # Few rows do not count in full: their columns are asked for once more.
        slow = np.flatnonzero((mask != 1).any(axis=1) | ~judged.all(axis=1))
        q, dq, ddq = (signal[slow] for signal in signals)
        slow_rows = self.regressor(q, dq, ddq, part.gravity)
        missing, speeds = 1 - mask[slow].T, np.ascontiguousarray(signals[1].T)
        groups, ones = len(mask) // size, np.ones(size)
        for joint, (sums, some, used) in enumerate(zip(all_sums, slow_rows, self.regressor.used, strict=True)):
            if not (judged[:, joint].any() or mask[:, joint].any()):
                continue
            wide = np.tanh(speeds[joint] / WIDER[:, None])
            count = len(used)
            rows = np.empty((groups, count + len(WIDER) + 1))
            rows[:, :count] = sums
            # A product: numpy's own sum along so short an axis takes four times as long.
            rows[:, count:-1] = (wide.reshape(-1, size) @ ones).reshape(len(WIDER), groups).T
            rows[:, -1] = tau[joint].reshape(groups, size) @ ones
            left_out = []
            for share in (missing[joint], ~judged[slow, joint]):
                own = np.flatnonzero(share)
                at = slow[own]
                lost = np.column_stack([some[own], wide[:, at].T, tau[joint, at]]) * share[own, None]
                left_out.append(summed(lost, at // size))
            products = side_products(rows, left_out, size)
            chosen = np.concatenate([used, self.base.size + joint * len(WIDER) + np.arange(len(WIDER))])
            for side, product in zip((sides.fitted, sides.judged), products, strict=True):
                side.gram[joint, block][np.ix_(chosen, chosen)] = product[:-1, :-1]
                side.cross[joint, block, chosen] = product[:-1, -1]
                side.square[joint, block] = product[-1, -1]
        sides.fitted.count[:, block] = mask.sum(axis=0) / size
        sides.judged.count[:, block] = judged.sum(axis=0) / size

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
                # More harmonics than a motion of an arm has cost the square of their number.
                orders = sorted({min(max(1, round(factor * cutoff * period)), 120) for factor in (0.5, 1.0, 2.0)})
                others += [Harmonics(period, order) for order in orders if order / period < 0.4 / self.period]
        return others

    def left_out(self, blocks: Sides, trial: Trial) -> Array:
        """RMS error of all rows of each block, but those at rest, predicted from the others (n,) [N m or N]."""
        judged = self.of_trial(blocks.judged, trial)
        squares = judged.squares(self._without(self.of_trial(blocks.fitted, trial), trial))
        return np.asarray(np.sqrt(squares / np.maximum(judged.count.sum(axis=1), 1)))

    def of_trial(self, side: Blocks, trial: Trial) -> Blocks:
        """Keeps the columns of a trial, with the widths of its friction signs."""
        return side.columns(self.widened(trial.columns, trial.scales).tolist())

    def _without(self, chosen: Blocks, trial: Trial) -> Array:
        """Parameters (B, b) of the fit without each block."""
        _, weights = self.estimator.solve(chosen.total.pulled(trial.prior), trial.ridge)
        return chosen.without(weights, trial.ridge, trial.prior)

    def pieces(self, part: Rows) -> list[slice]:
        """Cuts a stretch's rows into blocks."""
        rows = sum(len(log.log) for log in self.logs)
        pieces = max(1, round(self.candidates.blocks * len(part.motion) / rows))
        bounds = np.linspace(0, len(part.motion), pieces + 1).astype(int).tolist()
        return [slice(first, stop) for first, stop in pairwise(bounds)]

    def _scales(self, blocks: Sides, columns: NDArray[np.intp], ridge: float, prior: GaussianPrior) -> tuple[int, ...]:
        """Per joint the index of its velocity scale: the widest saving, if it is worth it."""
        total = blocks.fitted.total
        choices = np.array([self.widened(columns, [k] * len(total.count)) for k in range(len(VELOCITY_SCALES))])
        errors = np.array([total.residual(values) for values in blocks.fitted.fitted(choices, ridge, prior)])
        # Share of its residual that a wider sign must save a joint. Cross-validation would prefer wide ones even where
        # the truth is a sign, and bias the friction by many standard errors.
        worth = errors.min(axis=0) < (1 - 0.03) ** 2 * errors[0]
        return tuple(int(k) if yes else 0 for k, yes in zip(errors.argmin(axis=0), worth, strict=True))

    def widened(self, columns: Sequence[int] | NDArray[np.intp], scales: Sequence[int]) -> NDArray[np.intp]:
        """Exchanges the sign columns among some by those of the chosen scales."""
        chosen = np.array(columns, dtype=np.intp)
        extra = len(VELOCITY_SCALES) - 1
        for position, index in enumerate(columns):
            column = self.base.columns[index]
            scale = scales[column.joint - 1] if column.is_coulomb else 0
            if scale:
                chosen[position] = self.base.size + (column.joint - 1) * extra + scale - 1
        return chosen

    def _prior(self, blocks: Sides) -> GaussianPrior:
        # The columns of the wider signs come after those of the base.
        total = blocks.fitted.total.columns(np.arange(self.base.size))
        return default_prior(self.base, self.spread, column_levels(self.base, total))
