"""What an extension brings on data that its fit has not seen, with an interval that survives coloured errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.base_models.priors import explained_chi2, solve_map
from estimation.diagnosis.calibration import MAX_ERROR_RATIO, MIN_FIT_GAIN, MIN_UNRELIABLE_ERROR
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.recordings.log_reading import Recording
from estimation.regressions.parameter_priors import GaussianPrior

Array = NDArray[np.float64]

PARTS = 5
RESAMPLES = 500
SURELY = 1.96  # standard errors
BLOCK = 1.0  # [s], and five times the errors' correlation time


@dataclass(frozen=True, eq=False)
class HeldOutErrors:
    """Errors on data that the fits behind them had not seen.

    Attributes:
        how: one sentence: what was kept apart.
        t: time [s], (M,).
        step: sample period [s].
        measured: torque (M, n).
        errors: per model the errors (M, n): the base model first, the whole extended model last, and between them the
            extended model less one effect each.
        counts: rows that count (M, n): not those whose direction of motion is unknown.
        fitted: the errors on the same rows of fits that have seen them; None where no fit has.
        growth: per model, by how much the squared torque that the effect which it lacks explains grows when the unseen
            rows are fitted besides, over the variance that noise gives it (models,).
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
        """Residual RMS over torque RMS (n,) of one of the models."""
        return self._shares(self.errors[model])

    def retained_share(self, model: int, joints: Sequence[int]) -> float:
        """Share of the fall in NRMSE by a model's lacking effect, mean over joints, that is left on unseen data.

        One where nothing is known of fits that have seen the rows, or where they hardly differ.
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
        """By how much the extended model errs more on unseen rows (n,) than where it has seen them; never by less."""
        if self.fitted is None:
            return np.ones(self.measured.shape[1])
        unseen, seen = (self._rms(errors[-1]) for errors in (self.errors, self.fitted))
        return np.maximum(np.divide(unseen, seen, out=np.ones_like(unseen), where=seen > 0), 1.0)

    def is_unreliable(self, joint: int) -> bool:
        """Whether the extended model errs on unseen rows of a joint, from 0, far more than where it has seen them."""
        if self.fitted is None:
            return False
        unseen, seen = (float(self._shares(errors[-1])[joint]) for errors in (self.errors, self.fitted))
        return unseen > max(MAX_ERROR_RATIO * seen, MIN_UNRELIABLE_ERROR)

    def _shares(self, errors: Array) -> Array:
        return self._rms(errors) / np.maximum(self._rms(self.measured), 1e-300)

    def _rms(self, values: Array) -> Array:
        return np.sqrt((values**2 * self.counts).sum(axis=0) / np.maximum(self.counts.sum(axis=0), 1))

    def interval(self, before: int, after: int, joints: Sequence[int], rng: np.random.Generator) -> tuple[float, float]:
        """95 % interval of the fall in NRMSE from one model to another, averaged over joints, by moving blocks."""
        rows = len(self.t)
        block = int(min(max(round(self._block() / self.step), 1), max(rows // 4, 1)))
        level = np.maximum(self._rms(self.measured), 1e-300)
        sums = []
        for model in (before, after):
            squares = np.vstack([np.zeros((1, len(level))), np.cumsum(self.errors[model] ** 2 * self.counts, axis=0)])
            sums.append((squares[block:] - squares[:-block])[:, list(joints)])
        counted = np.vstack([np.zeros((1, len(level))), np.cumsum(self.counts, axis=0)])
        counted = (counted[block:] - counted[:-block])[:, list(joints)]
        starts = rng.integers(0, rows - block + 1, (RESAMPLES, max(1, rows // block)))
        count = np.maximum(counted[starts].sum(axis=1), 1)
        old, new = (np.sqrt(part[starts].sum(axis=1) / count) for part in sums)
        falls = ((old - new) / level[list(joints)]).mean(axis=1)
        low, high = np.quantile(falls, [0.025, 0.975])
        return float(low), float(high)

    def surely_worse(self, model: int) -> bool:
        """Whether unseen rows speak against the effect that a model lacks.

        What a cause explains of some rows grows by g'g + 2 g'e with others, g its torque there beside the base model,
        as far as that is known, and e the noise. Below -1.96^2 times the noise's variance that falls by chance once in
        40 times at most, whatever g is.
        """
        return self.growth[model] < -(SURELY**2)

    def _block(self) -> float:
        """Length of a block [s]."""
        times = []
        for column in self.errors[-1].T:
            series = column - column.mean()
            power = np.abs(np.fft.rfft(series, 2 * len(series))) ** 2
            correlation = np.fft.irfft(power)[: len(series)]
            below = np.flatnonzero(correlation < correlation[0] / np.e) if correlation[0] > 0 else np.zeros(1)
            times.append(float(below[0]) * self.step if len(below) else 0.0)
        return max(BLOCK, 5 * max(times))


def cross_validation_errors(problem: Problem, effects: Sequence[Array], pull: GaussianPrior) -> HeldOutErrors:
    """Fits on all runs but one, or all parts but one of a single run, and measures on the one left out.

    Args:
        problem: the data.
        effects: columns (N, n, k) of each effect found.
        pull: on base model, nuisance and effects.
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
    base = np.concatenate([problem.baseline.regressor, problem.baseline.nuisance], axis=2)
    counts = ~recording.sign_unknown
    weights = counts / problem.whitening.scales(len(recording))
    full = np.concatenate([base, *effects], axis=2)
    weighted = full * weights[:, :, None]
    target = recording.tau * weights
    grams: list[tuple[Array, Array]] = [_moments(weighted[fold], target[fold]) for fold in folds]
    total = (np.sum([g for g, _ in grams], axis=0), np.sum([c for _, c in grams], axis=0))
    chosen_by = model_columns(base.shape[2], effects)
    errors = [np.empty_like(recording.tau) for _ in chosen_by]
    fitted = [
        recording.tau
        - full[:, :, chosen] @ solve_map(total[0][np.ix_(chosen, chosen)], total[1][chosen], pull.columns(chosen))
        for chosen in chosen_by
    ]
    growth = np.zeros(len(chosen_by))
    for fold, (gram, cross) in zip(folds, grams, strict=True):
        rest = (total[0] - gram, total[1] - cross)
        growth += _growth(problem, rest, (gram, cross), float(np.sum(target[fold] ** 2)), counts[fold], pull, chosen_by)
        for error, chosen in zip(errors, chosen_by, strict=True):
            values = solve_map(rest[0][np.ix_(chosen, chosen)], rest[1][chosen], pull.columns(chosen))
            error[fold] = recording.tau[fold] - full[fold][:, :, chosen] @ values
    return HeldOutErrors(
        how, recording.t, recording.step, recording.tau, tuple(errors), counts, tuple(fitted), tuple(growth)
    )


def held_out_errors(
    problem: Problem,
    effects: Sequence[Array],
    unseen: Recording,
    unseen_base: Array,
    unseen_effects: Sequence[Array],
    pull: GaussianPrior,
) -> HeldOutErrors:
    """Fits on all logs and measures on others.

    Args:
        problem: the data of the fit.
        effects: columns (N, n, k) of each effect found, there.
        unseen: other logs.
        unseen_base: columns of base model and nuisance on them (M, n, b + m).
        unseen_effects: columns of each effect on them (M, n, k).
        pull: on base model, nuisance and effects.
    """
    recording = problem.recording
    base = np.concatenate([problem.baseline.regressor, problem.baseline.nuisance], axis=2)
    weights = ~recording.sign_unknown / problem.whitening.scales(len(recording))
    full = np.concatenate([base, *effects], axis=2)
    gram, cross = _moments(full * weights[:, :, None], recording.tau * weights)
    other = np.concatenate([unseen_base, *unseen_effects], axis=2)
    errors = []
    for chosen in model_columns(base.shape[2], effects):
        values = solve_map(gram[np.ix_(chosen, chosen)], cross[chosen], pull.columns(chosen))
        errors.append(unseen.tau - other[:, :, chosen] @ values)
    # Stretches of a log that was cut at gaps are named after it.
    logs = len({name.rpartition(" from ")[0] or name for name in unseen.names})
    how = f"{logs} log{'s' if logs > 1 else ''} that the fit has not seen"
    how += f", in {len(unseen.runs)} stretches" if len(unseen.runs) > logs else ""
    weights = ~unseen.sign_unknown / problem.whitening.scale
    target = unseen.tau * weights
    more, square = _moments(other * weights[:, :, None], target), float(np.sum(target**2))
    chosen_by = model_columns(base.shape[2], effects)
    growth = _growth(problem, (gram, cross), more, square, ~unseen.sign_unknown, pull, chosen_by)
    return HeldOutErrors(
        how, unseen.t, unseen.step, unseen.tau, tuple(errors), ~unseen.sign_unknown, growth=tuple(growth)
    )


def _growth(
    problem: Problem,
    fit: tuple[Array, Array],
    more: tuple[Array, Array],
    square: float,
    counts: NDArray[np.bool_],
    pull: GaussianPrior,
    chosen_by: Sequence[NDArray[np.intp]],
) -> Array:
    """See `Unseen.growth`: moments of the fit and of the unseen rows, whose squared torque and number are known.

    Errors beyond those of the noise, which a base model that is wrong makes, count as noise.
    """
    gains = []
    for chosen in chosen_by:
        own, place = pull.columns(chosen), np.ix_(chosen, chosen)
        both = fit[0][place] + more[0][place], fit[1][chosen] + more[1][chosen]
        gains.append(explained_chi2(*both, own) - explained_chi2(fit[0][place], fit[1][chosen], own))
    noise = problem.whitening.row_weight * max(1.0, (square - gains[-1]) / max(int(counts.sum()), 1))
    return (gains[-1] - np.array(gains)) / noise


def model_columns(base: int, effects: Sequence[Array]) -> list[NDArray[np.intp]]:
    """Columns of the base model, of the extended model less each effect, and of the extended model."""
    edges = np.cumsum([base, *(X.shape[2] for X in effects)])
    own = [np.arange(a, b) for a, b in pairwise(edges)]
    everything = np.arange(edges[-1])
    return [np.arange(base), *(np.setdiff1d(everything, part) for part in own), everything]


def _moments(Y: Array, target: Array) -> tuple[Array, Array]:
    flat = Y.reshape(-1, Y.shape[2])
    return flat.T @ flat, flat.T @ target.reshape(-1)
