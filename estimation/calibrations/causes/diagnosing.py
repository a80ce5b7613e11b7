"""The diagnosis: causes are named one by one, the one with most evidence first, until nothing significant is left."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimation.calibrations.causes.candidates import Candidate, candidates
from estimation.calibrations.causes.findings import CauseFinding
from estimation.calibrations.fit import GeometryFit, scaled_rows
from estimation.calibrations.weighting import Weights
from estimation.uncertainty.quantiles import student_95
from robots.common.arrays import Array
from robots.common.records import Record
from robots.geometry_errors.model import GeometryModel, Prediction
from robots.geometry_errors.poses import MeasuredPoses
from robots.geometry_errors.terms import TERMS
from robots.geometry_errors.terms.base import shown_unit
from robots.robot import Robot

ALPHA = 0.001
"""Probability that a robot without errors has a cause named."""

MOST = 30  # causes that are named
NEW = 1e-6  # share of a column that the causes before do not explain already
RIVAL = 6.0  # of the evidence (log of the odds), within which another cause may be meant
PERMUTATIONS = 999
LARGEST = 400  # poses that are looked at, evenly chosen
SINGLE = 0.1  # share of outliers, above which they are no single faults and count


@dataclass(frozen=True, kw_only=True)
class GeometryDiagnosis(Record):
    """Causes of what a description gets wrong.

    Attributes:
        findings: causes, those with most evidence first.
        evidence: p-value of each cause by itself, by "cause joint".
    """

    findings: tuple[CauseFinding, ...]
    evidence: dict[str, float]


def diagnose_geometry(
    robots: Sequence[Robot], poses: MeasuredPoses, fit: GeometryFit, *, used: NDArray[np.bool_] | None = None
) -> GeometryDiagnosis:
    """Names causes of errors of the description.

    All causes are linear about the fit. They are added by the Bayesian information criterion (Schwarz 1978), each with
    an F test; those that later ones make superfluous are taken out again.

    Args:
        robots: one per arm; causes are looked for in the first.
        poses: the measured poses.
        fit: a calibration of them.
        used: poses without outliers (N,); all by default.
    """
    whole = GeometryModel(robots, TERMS, poses)
    values = dict(zip((item.name for item in fit.model.errors), fit.values, strict=True))
    theta = np.array([values.get(item.name, 0.0) for item in whole.errors])
    found = whole.evaluate(theta, fit.setup)
    errors = len(theta)
    rows = np.ones(len(poses), dtype=bool) if used is None else used
    if np.mean(~rows) > SINGLE:
        rows = np.ones(len(poses), dtype=bool)
    counted = np.flatnonzero(rows)
    if len(counted) > LARGEST:
        # More poses make no cause clearer that these do not show.
        rows = np.zeros(len(poses), dtype=bool)
        rows[counted[np.linspace(0, len(counted) - 1, LARGEST).astype(int)]] = True
    weights = Weights(sigma=fit.weights.sigma, pose=rows.astype(float))
    # Taking the fitted errors back leaves what the description gets wrong.
    target = found.residual + found.jacobian[:, :, :errors] @ theta
    search = _Search(whole, replace(found, residual=target), weights, list(candidates(whole, found)))
    chosen = search.run()
    findings = search.findings(chosen)
    structure = search.structure(chosen)
    if structure < ALPHA:
        findings.append(
            CauseFinding(
                cause="unexplained", joint=None, marker=None, since=None, parameters=(), p_value=structure, share=1.0
            )
        )
    return GeometryDiagnosis(findings=tuple(findings), evidence=search.evidence())


class _Search:
    """Forward selection of groups of columns, in standard deviations."""

    def __init__(self, model: GeometryModel, found: Prediction, weights: Weights, options: Sequence[Candidate]) -> None:
        self.model, self.found, self.weights = model, found, weights
        errors = len(model.errors)
        base, target = scaled_rows(found, weights, model, range(errors, found.jacobian.shape[2]))
        self.options = list(options)
        columns = np.hstack([base, *(self._rows(option.columns) * option.scale for option in self.options)])
        self.rows, self._measured = len(target), (columns, target)
        # A triangle has the same inner products, and fewer rows.
        triangle = np.asarray(np.linalg.qr(np.column_stack([columns, target]), mode="r"))
        self.base, self.target = triangle[:, : base.shape[1]], triangle[:, -1]
        sizes = [len(option.parameters) for option in self.options]
        self._ends = base.shape[1] + np.cumsum([0, *sizes])
        self._whole = triangle
        self._causes = len({option.key for option in self.options})

    def _rows(self, columns: Array) -> Array:
        factor = self.weights.rows(self.model.poses.measurement.units)
        seen = np.isfinite(self.found.residual) & (factor > 0.0)
        return np.asarray(columns[seen] * factor[seen][:, None])

    def _places(self, numbers: Sequence[int]) -> NDArray[np.int64]:
        """Places of the columns of some causes."""
        blocks = [np.arange(self._ends[k], self._ends[k + 1]) for k in numbers]
        return np.concatenate([np.zeros(0, dtype=np.int64), *blocks])

    def _columns(self, numbers: Sequence[int]) -> Array:
        """Columns of some causes, side by side, in the triangle."""
        return np.asarray(self._whole[:, self._places(numbers)])

    def run(self) -> list[int]:
        """Numbers of the causes that are named, in the order in which they were added."""
        chosen: list[int] = []
        for _ in range(MOST):
            scores = self._scores(chosen)
            best = max(scores, key=lambda k: scores[k][0], default=None)
            if best is None or scores[best][0] <= 0.0 or scores[best][1] > ALPHA:
                break
            chosen.append(best)
            chosen = self._pruned(chosen)
        return chosen

    def _pruned(self, chosen: list[int]) -> list[int]:
        """Takes causes out that the others make superfluous."""
        kept = list(chosen)
        for k in chosen[:-1]:
            others = [j for j in kept if j != k]
            score = self._scores(others, only=[k])
            if k in kept and (k not in score or score[k][0] <= 0.0 or score[k][1] > ALPHA):
                kept = others
        return kept

    def _basis(self, chosen: Sequence[int]) -> Array:
        return _orthonormal(np.hstack([self.base, self._columns(chosen)]))

    def _scores(self, chosen: Sequence[int], only: Sequence[int] | None = None) -> dict[int, tuple[float, float]]:
        """Gain in evidence, and p-value, of each cause beside those chosen."""
        basis = self._basis(chosen)
        left = self.target - basis @ (basis.T @ self.target)
        square, free = float(left @ left), self.rows - basis.shape[1]
        taken = {self.options[k].key for k in chosen}
        numbers = [
            k
            for k in (range(len(self.options)) if only is None else only)
            if only is not None or self.options[k].key not in taken
        ]
        result = {}
        for k, size, gain in self._gains(numbers, basis, left):
            if free - size < 1:
                continue
            rest = max(square - gain, 1e-12 * square)
            tries = self.options[k].tries
            score = 0.5 * self.rows * np.log(square / rest) - 0.5 * size * np.log(self.rows) - np.log(tries)
            result[k] = (float(score), _p_value(gain, rest, size, free - size, tries * self._causes))
        return result

    def _gains(self, numbers: Sequence[int], basis: Array, left: Array) -> Iterator[tuple[int, int, float]]:
        """Number of directions that each cause brings beside a basis, and the square that they take of what is left."""
        for size in sorted({len(self.options[k].parameters) for k in numbers}):
            same = [k for k in numbers if len(self.options[k].parameters) == size]
            columns = self._columns(same)
            lengths = np.linalg.norm(columns, axis=0)
            new = (columns - basis @ (basis.T @ columns)) / np.where(lengths > 0.0, lengths, 1.0)
            blocks = new.reshape(len(new), len(same), size).transpose(1, 0, 2)
            values, vectors = np.linalg.eigh(np.swapaxes(blocks, 1, 2) @ blocks)
            along = np.einsum("kji,kj->ki", vectors, (new.T @ left).reshape(len(same), size))
            open_ = values > size * NEW**2
            gains = np.sum(np.where(open_, along**2 / np.where(open_, values, 1.0), 0.0), axis=1)
            yield from ((k, int(o.sum()), float(g)) for k, o, g in zip(same, open_, gains, strict=True) if o.any())

    def findings(self, chosen: list[int]) -> list[CauseFinding]:
        """Values with intervals of the causes that were named."""
        if not chosen:
            return []
        columns = np.hstack([self.base, self._columns(chosen)])
        lengths = np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
        inverse = np.linalg.pinv(columns / lengths, rcond=1e-8)
        value = inverse @ self.target / lengths
        left = self.target - columns @ value
        free = max(self.rows - int(np.linalg.matrix_rank(columns / lengths, tol=1e-8)), 1)
        spread = np.sqrt(np.sum(inverse**2, axis=1) * float(left @ left) / free) / lengths
        width = student_95(free)
        nothing = self._basis([])
        before = float(np.sum((self.target - nothing @ (nothing.T @ self.target)) ** 2))
        found, start = [], self.base.shape[1]
        for k in chosen:
            option = self.options[k]
            others = [j for j in chosen if j != k]
            scores = self._scores(others)
            basis = self._basis(others)
            without = float(np.sum((self.target - basis @ (basis.T @ self.target)) ** 2))
            size = len(option.parameters)
            parameters = []
            block = slice(start, start + size)
            for name, unit, scale, v, s in zip(
                option.parameters, option.units, option.scale, value[block], spread[block], strict=True
            ):
                parameters.append(
                    {
                        "name": name,
                        "value": float(v * scale),
                        "ci95": [float((v - width * s) * scale), float((v + width * s) * scale)],
                        "unit": unit,
                        "shown": shown_unit(unit),
                    }
                )
            start += size
            own = scores.get(k, (0.0, 1.0))
            rivals = sorted(
                (
                    j
                    for j in scores
                    if j != k
                    and self.options[j].key != option.key
                    and scores[j][0] > own[0] - RIVAL
                    and scores[j][0] > 0
                ),
                key=lambda j: -scores[j][0],
            )
            names = dict.fromkeys(_label(self.options[j]) for j in rivals)
            found.append(
                CauseFinding(
                    cause=option.cause,
                    joint=option.joint,
                    marker=option.marker,
                    since=option.since,
                    parameters=tuple(parameters),
                    p_value=own[1],
                    share=max(without - float(left @ left), 0.0) / max(before, 1e-300),
                    rivals=tuple(names)[:3],
                )
            )
        return sorted(found, key=lambda item: -item.share)

    def evidence(self) -> dict[str, float]:
        """The p-value of each cause by itself."""
        best: dict[str, float] = {}
        for k, (_, p) in self._scores([]).items():
            label = _label(self.options[k])
            best[label] = min(p, best.get(label, 1.0))
        return best

    def structure(self, chosen: Sequence[int]) -> float:
        """Probability that residuals of like poses are as alike by chance as they are (permutations of the poses).

        Poses are alike in their joint positions, or in the place of the flange: the lower probability counts twice.
        """
        columns, target = self._measured
        basis = _orthonormal(np.hstack([columns[:, : self._ends[0]], columns[:, self._places(chosen)]]))
        left = target - basis @ (basis.T @ target)
        whole = np.zeros(self.found.residual.shape)
        factor = self.weights.rows(self.model.poses.measurement.units)
        whole[np.isfinite(self.found.residual) & (factor > 0.0)] = left
        rows = np.flatnonzero(self.weights.pose > 0.0)
        whole, q = whole[rows], self.model.poses.q[rows]
        span = np.ptp(q, axis=0)
        places = self.model.robots[0].chain.flange(q)[:, :3, 3]
        found = [_likeness(whole, where) for where in (q / np.where(span > 0.0, span, 1.0), places)]
        return min(1.0, 2.0 * min(found))


def _likeness(residual: Array, where: Array) -> float:
    """Probability that residuals of the three nearest neighbours are as alike as they are, by permutations."""
    distance = np.linalg.norm(where[:, None] - where[None], axis=2)
    np.fill_diagonal(distance, np.inf)
    near = np.argsort(distance, axis=1)[:, :3]
    alike = residual @ residual.T

    def statistic(order: NDArray[np.int64]) -> float:
        return float(alike[order[:, None], order[near]].sum())

    rng = np.random.default_rng(0)
    own = statistic(np.arange(len(where)))
    above = sum(statistic(rng.permutation(len(where))) >= own for _ in range(PERMUTATIONS))
    return (above + 1) / (PERMUTATIONS + 1) if above else _normal_tail(own, statistic, len(where), rng)


def _normal_tail(own: float, statistic: Any, rows: int, rng: np.random.Generator) -> float:
    """The tail beyond all permutations, by the normal distribution."""
    from scipy.special import ndtr

    drawn = np.array([statistic(rng.permutation(rows)) for _ in range(200)])
    return float(ndtr(-(own - drawn.mean()) / max(float(drawn.std()), 1e-300)))


def _p_value(gain: float, rest: float, size: int, free: int, tries: int) -> float:
    from scipy.special import fdtrc

    return min(1.0, tries * float(fdtrc(size, free, (gain / size) / (rest / free))))


def _orthonormal(columns: Array) -> Array:
    """Basis of the columns' space (R, k), directions that are rounding left out."""
    size = np.linalg.norm(columns, axis=0)
    scaled = columns / np.where(size > 0.0, size, 1.0)
    left, values, _ = np.linalg.svd(scaled, full_matrices=False)
    return np.asarray(left[:, values > NEW * max(float(np.sqrt(scaled.shape[1])), 1.0)])


def _label(option: Candidate) -> str:
    name = option.cause.replace("_", " ")
    if option.joint is not None:
        return f"{name} of joint {option.joint}"
    return f"{name} {option.marker}" if option.marker is not None else name
