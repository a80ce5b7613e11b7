"""Which kinds of errors the poses support: those that predict held-out poses better."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from estimation.calibrations.fit import GeometryFit, fit_geometry
from estimation.calibrations.folds import fold_numbers, outside_range
from estimation.calibrations.sizes import Normal, estimate_sizes, kind_numbers
from estimation.calibrations.weighting import pose_distance
from robots.common.arrays import Array
from robots.geometry_errors.model import GeometryModel
from robots.geometry_errors.poses import MeasuredPoses
from robots.geometry_errors.terms import ErrorTerm
from robots.robot import Robot

CLEAR = 1.0
"""Standard errors by which the held-out error has to fall before a kind is added."""

RELEVANT = 0.02
"""Share of the squared held-out distance that a kind has to take away, beside that."""

GROSS = 6.0  # times the median distance: such poses decide nothing about kinds


@dataclass(frozen=True, kw_only=True, eq=False)
class KindTrial:
    """Held-out error with and without a kind of errors.

    Attributes:
        kind: its name.
        without: held-out error (RMS) in the measurement's first unit.
        with_it: the same with the kind.
        clear: decrease of the squared distance over its standard error.
        added: whether it was added.
    """

    kind: str
    without: float
    with_it: float
    clear: float
    added: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class HeldOut:
    """Errors of poses that the fit has not seen.

    Attributes:
        residual: of each pose by a fit to the other folds (N, r).
        error: of each pose (N,) in the measurement's first unit.
        outside: whether a pose lies outside the range of the others (N,).
    """

    residual: Array
    error: Array
    outside: NDArray[np.bool_]

    def rms(self, rows: NDArray[np.bool_] | None = None) -> float:
        """Root mean square of the errors of some poses; NaN where there is none."""
        own = self.error[np.isfinite(self.error) & (np.ones(len(self.error), dtype=bool) if rows is None else rows)]
        return float(np.sqrt(np.mean(own**2))) if own.size else float("nan")


class LinearFolds:
    """The model about a fit as linear equations, summed up by folds.

    Args:
        fit: about which the model is linear; it has all columns.
        folds: number of each pose.
    """

    def __init__(self, fit: GeometryFit, folds: NDArray[np.int64]) -> None:
        self.fit, self.folds = fit, folds
        errors = len(fit.values)
        factor = fit.weights.rows(fit.model.poses.measurement.units)
        seen = np.isfinite(fit.residual) & (factor > 0.0)
        self.jacobian = fit.jacobian * np.array([item.scale for item in fit.parameters])
        # The target holds the errors that were fitted already, so that they can be taken back.
        self.target = fit.residual + fit.jacobian[:, :, :errors] @ fit.values
        self._parts: dict[int, Normal] = {}
        for fold in np.unique(folds):
            rows = seen & (folds == fold)[:, None]
            matrix, aim = self.jacobian[rows] * factor[rows][:, None], self.target[rows] * factor[rows]
            self._parts[int(fold)] = Normal.of(matrix, aim)
        self._whole = sum(list(self._parts.values())[1:], next(iter(self._parts.values())))

    def residuals(self, kinds: set[str]) -> Array:
        """Residuals of each fold by a fit of some kinds to the others (N, r).

        Args:
            kinds: of errors, beside the setup.
        """
        fit, errors = self.fit, len(self.fit.values)
        chosen = [k for k, item in enumerate(fit.parameters) if k >= errors or item.kind in kinds]
        names = [kind for kind in dict.fromkeys(item.kind for item in fit.model.errors) if kind in kinds]
        numbers = kind_numbers([fit.parameters[k].kind for k in chosen], names)
        sizes = np.array([fit.sizes.get(name, 1.0) for name in names])
        result = np.full(fit.residual.shape, np.nan)
        for fold, part in self._parts.items():
            mine = self.folds == fold
            _, _, found = estimate_sizes((self._whole - part).part(chosen), numbers, sizes)
            result[mine] = self.target[mine] - self.jacobian[mine][:, :, chosen] @ found
        return result


def select_kinds(
    robots: Sequence[Robot], terms: Sequence[ErrorTerm], poses: MeasuredPoses, *, seed: int = 0
) -> tuple[tuple[ErrorTerm, ...], tuple[KindTrial, ...]]:
    """Adds kinds of errors one by one, each time the one that lowers the error of held-out poses most.

    Where none does, two are tried together.

    Args:
        robots: one per arm.
        terms: that may be added.
        poses: the measured poses.
        seed: of the folds.

    Returns:
        The kinds in the order of `terms`, and the trials in the order in which they were added; those that were not
        added last.
    """
    folds = fold_numbers(poses.q, seed=seed)
    whole = GeometryModel(robots, terms, poses)
    chosen: list[ErrorTerm] = []
    usable = [term for term in terms if any(item.kind == term.kind for item in whole.errors)]
    trials: list[KindTrial] = []
    while True:
        fit = _about(whole, robots, chosen, poses)
        kinds = {term.kind for term in chosen}
        linear = LinearFolds(fit, folds)
        before = _distances(linear, kinds)
        open_ = [term for term in usable if term.kind not in kinds]
        if not open_:
            return _ordered(terms, chosen), tuple(trials)

        def tried(new: Sequence[ErrorTerm]) -> tuple[Sequence[ErrorTerm], KindTrial]:
            return new, _trial(fit, new, before, _distances(linear, _with(kinds, new)))  # noqa: B023

        found = [tried((term,)) for term in open_]
        rest = [trial for _, trial in found]
        # Two may be needed where neither helps by itself: links that bend stand elsewhere, too.
        if not any(trial.added for trial in rest):
            found = [tried(pair) for pair in combinations(open_, 2)]
        better = [item for item in found if item[1].added]
        if not better:
            return _ordered(terms, chosen), (*trials, *rest)
        # Of kinds that explain the same, the first in order counts.
        lowest = min(trial.with_it for _, trial in better)
        new, best = next(item for item in better if item[1].with_it <= (1.0 + RELEVANT) * lowest)
        chosen += [term for term in terms if term.kind in _with(set(), new) and term not in chosen]
        trials += [replace(best, kind=term.kind) for term in new]


def _with(kinds: set[str], terms: Sequence[ErrorTerm]) -> set[str]:
    """Kinds, and those of some terms with all that they contain."""
    return kinds.union(*({term.kind, *term.includes} for term in terms))


def held_out_errors(fit: GeometryFit, *, seed: int = 0) -> HeldOut:
    """Predicts each fold by a fit to the others, linear about the fit to all.

    Args:
        fit: to all poses.
        seed: of the folds.
    """
    poses, used = fit.model.poses, fit.used
    folds = fold_numbers(poses.q, seed=seed)
    residual = LinearFolds(fit, folds).residuals({item.kind for item in fit.model.errors})
    outside = np.zeros(len(poses), dtype=bool)
    for fold in np.unique(folds):
        mine = folds == fold
        if (used & ~mine).any():
            outside[mine] = outside_range(poses.q[mine], poses.q[~mine & used])
    return HeldOut(residual=residual, error=poses.measurement.error(residual), outside=outside)


def _about(whole: GeometryModel, robots: Sequence[Robot], chosen: list[ErrorTerm], poses: MeasuredPoses) -> GeometryFit:
    """The fit of the chosen kinds, with the columns of all kinds at its solution."""
    own = fit_geometry(GeometryModel(robots, chosen, poses))
    values = dict(zip((item.name for item in own.model.errors), own.values, strict=True))
    full = np.array([values.get(item.name, 0.0) for item in whole.errors])
    found = whole.evaluate(full, own.setup)
    distance = pose_distance(own.residual, poses.measurement.units, own.weights.sigma)
    far = distance > GROSS * np.median(distance[distance > 0.0])
    weights = replace(own.weights, pose=np.where(far, 0.0, own.weights.pose))
    return GeometryFit(
        model=whole,
        values=full,
        setup=own.setup,
        parameters=whole.parameters(own.setup),
        reduction=own.reduction,
        sizes=own.sizes,
        residual=found.residual,
        jacobian=found.jacobian,
        weights=weights,
        hat=own.hat,
        covariance=own.covariance,
    )


def _distances(linear: LinearFolds, kinds: set[str]) -> tuple[Array, Array]:
    """Held-out residuals with some kinds (N, r), and the squared distance of each pose (N,)."""
    residual, fit = linear.residuals(kinds), linear.fit
    return residual, pose_distance(residual, fit.model.poses.measurement.units, fit.weights.sigma) ** 2


def _trial(
    fit: GeometryFit, terms: Sequence[ErrorTerm], before: tuple[Array, Array], after: tuple[Array, Array]
) -> KindTrial:
    # Poses that fit badly decide as little as they count in the fit.
    gain = fit.weights.pose * (before[1] - after[1])
    error = float(np.std(gain, ddof=1) / np.sqrt(len(gain))) if len(gain) > 1 else np.inf
    clear = float(np.mean(gain)) / max(error, np.finfo(float).tiny)
    measure = fit.model.poses.measurement.error
    weight = fit.weights.pose / fit.weights.pose.sum()
    rms = [float(np.sqrt(np.nansum(weight * measure(residual) ** 2))) for residual in (before[0], after[0])]
    enough = float(np.mean(gain)) > RELEVANT * float(np.mean(fit.weights.pose * before[1]))
    kind = " and ".join(term.kind for term in terms)
    return KindTrial(kind=kind, without=rms[0], with_it=rms[1], clear=clear, added=clear > CLEAR and enough)


def _ordered(terms: Sequence[ErrorTerm], chosen: Sequence[ErrorTerm]) -> tuple[ErrorTerm, ...]:
    return tuple(term for term in terms if term in chosen)
