"""Gain of an extended model on held-out data, with a block bootstrap interval for correlated errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from itertools import pairwise
from operator import add

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.calibration import MAX_ERROR_RATIO, MIN_FIT_GAIN, MIN_UNRELIABLE_ERROR
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.recordings.recording import Recording
from estimation.regressions.moments import Moments
from estimation.regressions.parameter_priors import GaussianPrior
from estimation.uncertainty.blocks import moving_block_sums
from estimation.uncertainty.correlations import correlation_rows
from estimation.uncertainty.quantiles import CHI2_95, TAIL_95
from robots.common.arrays import Array
from robots.common.plain import several

PARTS = 5  # stretches into which a log is split
RESAMPLES = 500  # bootstrap samples of an interval
BLOCK = 1.0  # shortest block [s]; longer ones have five times the correlation time of the errors


@dataclass(frozen=True, eq=False)
class HeldOutErrors:
    """Errors of several models on held-out data.

    The models are the base model, the extended model without each of its effects, and the extended model, in this
    order.

    Attributes:
        how: how the held-out data were separated, as text.
        t: time [s], (M,).
        step: sample period [s].
        measured: measured torque (M, n) [N m or N].
        errors: per model the torque errors (M, n) [N m or N].
        counts: rows that count (M, n): those with a known friction sign.
        fitted: errors of fits that include these rows; None with separate held-out logs.
        growth: per model the chi2 that its missing effects gain when the held-out rows are added to the fit
            (models,); negative if the held-out rows contradict them.
    """

    how: str
    t: Array
    step: float
    measured: Array
    errors: tuple[Array, ...]
    counts: NDArray[np.bool_]
    fitted: tuple[Array, ...] | None = None
    growth: tuple[float, ...] = ()

    def nrmse(self, model: int) -> Array:
        """Returns the error RMS over the torque RMS (n,).

        Args:
            model: index of the model.
        """
        return self._shares(self.errors[model])

    def retained_share(self, model: int, joints: Sequence[int]) -> float:
        """Returns the share of an effect's NRMSE reduction that remains on held-out data.

        It is 1 without errors of fits that include the rows, or if these fits hardly differ.

        Args:
            model: index of the model without the effect.
            joints: joints, from 0, over which the reductions are averaged.
        """
        if self.fitted is None:
            return 1.0
        before, after, *unseen = (
            float(self._shares(errors[k])[list(joints)].mean())
            for errors in (self.fitted, self.errors)
            for k in (model, -1)
        )
        return 1.0 if before - after <= MIN_FIT_GAIN * before else (unseen[0] - unseen[1]) / (before - after)

    def support_growth(self) -> Array:
        """Returns the error RMS of the extended model on held-out rows over that in the fit (n,), at least 1."""
        if self.fitted is None:
            return np.ones(self.measured.shape[1])
        unseen, seen = (self._rms(errors[-1]) for errors in (self.errors, self.fitted))
        return np.maximum(np.divide(unseen, seen, out=np.ones_like(unseen), where=seen > 0), 1.0)

    def is_unreliable(self, joint: int) -> bool:
        """Whether the held-out error of the extended model on a joint (from 0) is much larger than its fit error."""
        if self.fitted is None:
            return False
        unseen, seen = (float(self._shares(errors[-1])[joint]) for errors in (self.errors, self.fitted))
        return unseen > max(MAX_ERROR_RATIO * seen, MIN_UNRELIABLE_ERROR)

    def _shares(self, errors: Array) -> Array:
        return self._rms(errors) / np.maximum(self._rms(self.measured), 1e-300)

    def _rms(self, values: Array) -> Array:
        return np.sqrt((values**2 * self.counts).sum(axis=0) / np.maximum(self.counts.sum(axis=0), 1))

    def interval(self, before: int, after: int, joints: Sequence[int], rng: np.random.Generator) -> tuple[float, float]:
        """Returns the 95 % interval of the NRMSE reduction from one model to another, by a moving block bootstrap.

        Args:
            before: index of one model.
            after: index of the other model.
            joints: joints, from 0, over which the reductions are averaged.
            rng: random generator of the bootstrap.
        """
        rows = len(self.t)
        block = int(min(max(round(self._block() / self.step), 1), max(rows // 4, 1)))
        own = list(joints)
        level, counts = np.maximum(self._rms(self.measured), 1e-300)[own], self.counts[:, own]
        squares = [self.errors[model][:, own] ** 2 * counts for model in (before, after)]
        sums = moving_block_sums(np.hstack([*squares, counts]), block, RESAMPLES, rng)
        old, new, counted = np.split(sums, 3, axis=1)
        falls = ((np.sqrt(old / np.maximum(counted, 1)) - np.sqrt(new / np.maximum(counted, 1))) / level).mean(axis=1)
        low, high = np.quantile(falls, [TAIL_95, 1 - TAIL_95])
        return float(low), float(high)

    def surely_worse(self, model: int) -> bool:
        """Whether the held-out rows significantly contradict the effect that a model lacks.

        If the effect is true, its chi2 grows by g'g + 2 g'e on the held-out rows: g is its torque there beside the
        base model, e the noise. This falls below -`CHI2_95` noise variances with a probability of 2.5 % at most,
        for any g.

        Args:
            model: index of the model without the effect.
        """
        return self.growth[model] < -CHI2_95

    def _block(self) -> float:
        """Computes the length of a bootstrap block [s] from the correlation time of the errors."""
        return max(BLOCK, 5 * self.step * max(correlation_rows(column) for column in self.errors[-1].T))


def cross_validation_errors(problem: Problem, effects: Sequence[Array], pull: GaussianPrior) -> HeldOutErrors:
    """Cross-validates the models over logs, or over stretches of a single log.

    Args:
        problem: data of the fit.
        effects: columns (N, n, k) of each effect.
        pull: prior of base model, nuisance and effects.

    Returns:
        The errors on each log or stretch of the fit to the others.
    """
    recording = problem.recording
    runs = recording.runs
    if len(runs) > 1:
        folds = list(runs)
        how = f"each of {len(runs)} logs, predicted from the others"
    else:
        edges = np.linspace(0, len(recording), PARTS + 1).astype(int)
        folds = [slice(int(a), int(b)) for a, b in pairwise(edges)]
        how = (
            f"each of {PARTS} stretches of the only log, predicted from the other stretches: the same kind of motion, "
            "so that the gain on another motion may differ"
        )
    weights = ~recording.sign_unknown / problem.whitening.scales(len(recording))
    full = np.concatenate([problem.baseline.columns, *effects], axis=2)
    parts = [Moments.of(full[fold], recording.tau[fold], weights[fold]).joined().pulled(pull) for fold in folds]
    total = reduce(add, parts)
    tests = [(full[fold], total - part, part) for fold, part in zip(folds, parts, strict=True)]
    found = _tested(problem, how, recording, effects, tests)
    torques = _torques(full, total, model_columns(problem.baseline.columns.shape[2], effects))
    return replace(found, fitted=tuple(recording.tau - torque for torque in torques))


def held_out_errors(
    problem: Problem,
    effects: Sequence[Array],
    unseen: Recording,
    unseen_base: Array,
    unseen_effects: Sequence[Array],
    pull: GaussianPrior,
) -> HeldOutErrors:
    """Fits the models to the logs of the fit and computes their errors on held-out logs.

    Args:
        problem: data of the fit.
        effects: columns (N, n, k) of each effect on the data of the fit.
        unseen: held-out logs.
        unseen_base: columns of base model and nuisance on the held-out logs (M, n, b + m).
        unseen_effects: columns of each effect on the held-out logs (M, n, k).
        pull: prior of base model, nuisance and effects.

    Returns:
        The errors on the held-out logs.
    """
    recording = problem.recording
    weights = ~recording.sign_unknown / problem.whitening.scales(len(recording))
    full = np.concatenate([problem.baseline.columns, *effects], axis=2)
    fit = Moments.of(full, recording.tau, weights).joined().pulled(pull)
    other = np.concatenate([unseen_base, *unseen_effects], axis=2)
    more = Moments.of(other, unseen.tau, ~unseen.sign_unknown / problem.whitening.scale).joined().pulled(pull)
    # Stretches of a log that was cut at gaps contain its name.
    logs = len({name.rpartition(" from ")[0] or name for name in unseen.names})
    how = f"{several(logs, 'log')} that the fit has not seen"
    how += f", in {len(unseen.runs)} stretches" if len(unseen.runs) > logs else ""
    return _tested(problem, how, unseen, effects, [(other, fit, more)])


def _tested(
    problem: Problem,
    how: str,
    unseen: Recording,
    effects: Sequence[Array],
    tests: Sequence[tuple[Array, Moments, Moments]],
) -> HeldOutErrors:
    """Tests the models on all rows of a recording, part by part.

    Errors of the base model increase the held-out residual; in `HeldOutErrors.growth` they count as noise.

    Args:
        problem: data of the fit.
        how: how the rows were separated.
        unseen: the held-out rows.
        effects: columns of each effect.
        tests: of each part the columns (M, n, p), and the normal equations of the fit and of the part.
    """
    chosen_by, growth = model_columns(problem.baseline.columns.shape[2], effects), np.zeros(2 + len(effects))
    for _, fit, more in tests:
        both = fit + more
        gains = np.array([both.columns(own).explained() - fit.columns(own).explained() for own in chosen_by])
        left = (float(more.square[0]) - gains[-1]) / max(int(more.count[0]), 1)
        growth += (gains[-1] - gains) / (problem.whitening.row_weight * max(1.0, left))
    torques = zip(*(_torques(X, fit, chosen_by) for X, fit, _ in tests), strict=True)
    return HeldOutErrors(
        how=how,
        t=unseen.t,
        step=unseen.step,
        measured=unseen.tau,
        errors=tuple(unseen.tau - np.concatenate(parts) for parts in torques),
        counts=~unseen.sign_unknown,
        growth=tuple(growth),
    )


def _torques(columns: Array, fit: Moments, chosen_by: Sequence[NDArray[np.intp]]) -> list[Array]:
    """Evaluates the torque (M, n) of each model of a fit on rows (M, n, p)."""
    return [columns[:, :, chosen] @ fit.columns(chosen).posterior() for chosen in chosen_by]


def model_columns(base: int, effects: Sequence[Array]) -> list[NDArray[np.intp]]:
    """Returns the columns of each model in the order of `HeldOutErrors`.

    Args:
        base: number of columns of base model and nuisance.
        effects: columns (N, n, k) of each effect.

    Returns:
        Per model the indices of its columns.
    """
    edges = np.cumsum([base, *(X.shape[2] for X in effects)])
    own = [np.arange(a, b) for a, b in pairwise(edges)]
    everything = np.arange(edges[-1])
    return [np.arange(base), *(np.setdiff1d(everything, part) for part in own), everything]
