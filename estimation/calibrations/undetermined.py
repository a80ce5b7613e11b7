"""What poses do not determine: errors that no pose distinguishes, and errors that other poses would show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from estimation.calibrations.fit import GeometryFit
from robots.common.arrays import Array
from robots.geometry_errors.model import GeometryModel
from robots.geometry_errors.poses import MeasuredPoses, approaches
from robots.geometry_errors.terms import ErrorTerm
from robots.geometry_errors.virtual import random_positions
from robots.robot import Robot

POSES = 200  # drawn per question
REDUNDANT = 1e-6  # of a column that is new at random poses; rounding leaves 1e-12
LEARNED = 0.5  # standard error over size of the prior, above which the poses said little
HELPS, ALIKE = 0.5, 1.5  # a motion that halves the standard error helps; those within this of the best are named


@dataclass(frozen=True, kw_only=True)
class Undetermined:
    """An error that the poses do not determine.

    Attributes:
        name: of the parameter.
        joint: that it belongs to, from 1.
        reason: "redundant": no pose distinguishes it from others. "poses": other poses would show it.
        partners: names of the parameters that it cannot be distinguished from; the estimates contain it.
        joints: joints whose motion would show it, from 1.
    """

    name: str
    joint: int | None
    reason: Literal["redundant", "poses"]
    partners: tuple[str, ...] = ()
    joints: tuple[int, ...] = ()

    def sentence(self) -> str:
        """Says it in words."""
        if self.reason == "redundant":
            where = f" from {', '.join(self.partners)}" if self.partners else ": it moves nothing that was measured"
            return f"{self.name}: no pose distinguishes it{where}"
        if not self.joints:
            return f"{self.name}: more poses, or another measurement, would show it"
        moved = ", ".join(map(str, self.joints))
        return (
            f"{self.name}: poses with more motion of joint{'s' if len(self.joints) > 1 else ''} {moved} would show it"
        )


def undetermined(robots: Sequence[Robot], terms: Sequence[ErrorTerm], fit: GeometryFit) -> tuple[Undetermined, ...]:
    """Lists the errors that were left out or learned little of, with the reason and a remedy.

    Args:
        robots: one per arm.
        terms: kinds of errors that were fitted.
        fit: to the poses.
    """
    errors = fit.model.errors
    kept = list(fit.reduction.kept)
    place = {k: i for i, k in enumerate(kept)}
    spread = np.sqrt(np.diag(fit.covariance))
    weak = [
        k for k in kept if k < len(errors) and spread[place[k]] > LEARNED * fit.sizes[errors[k].kind] * errors[k].scale
    ]
    left_out = [k for k in range(len(errors)) if k not in place]
    if not left_out and not weak:
        return ()
    questions = _Questions(robots, terms, fit)
    found = [questions.left_out(k) for k in left_out] + [questions.weak(k) for k in weak]
    return tuple(sorted(found, key=lambda item: [p.name for p in errors].index(item.name)))


class _Questions:
    """Jacobians at other poses, in standard deviations and usual sizes."""

    def __init__(self, robots: Sequence[Robot], terms: Sequence[ErrorTerm], fit: GeometryFit) -> None:
        self.robots, self.terms, self.fit = robots, terms, fit
        self.parameters = fit.parameters
        self.scale = np.array([item.scale for item in self.parameters])
        sigma = np.array([fit.weights.sigma[unit] for unit in fit.model.poses.measurement.units])
        self.sigma = sigma
        self.own = self._gram(fit.model.poses.part(fit.used))
        rng = np.random.default_rng(0)
        poses = fit.model.poses
        self.drawn = poses.part(np.arange(POSES) % len(poses))
        self.rows = self._rows(_at(self.drawn, random_positions(robots[0], POSES, seed=0), rng, robots))
        self.joints = self._by_joint()

    def left_out(self, k: int) -> Undetermined:
        """Says why a parameter has no place in the minimal set."""
        item = self.parameters[k]
        kept = list(self.fit.reduction.kept)
        column = self.rows[:, k]
        solved, *_ = np.linalg.lstsq(self.rows[:, kept], column, rcond=1e-10)
        new = np.linalg.norm(column - self.rows[:, kept] @ solved)
        if new <= REDUNDANT * np.linalg.norm(column):
            share = np.abs(solved) * np.linalg.norm(self.rows[:, kept], axis=0)
            order = [j for j in np.argsort(-share) if share[j] > 0.1 * share.max(initial=0.0)]
            names = tuple(self.parameters[kept[j]].name for j in order[:4]) if share.max(initial=0.0) > 0 else ()
            return Undetermined(name=item.name, joint=item.joint, reason="redundant", partners=names)
        return self._by_motion(k, [*kept, k])

    def weak(self, k: int) -> Undetermined:
        """Says which motion would determine a parameter of which the poses say little."""
        return self._by_motion(k, list(self.fit.reduction.kept))

    def _by_motion(self, k: int, columns: list[int]) -> Undetermined:
        item, errors = self.parameters[k], len(self.fit.values)
        sizes = [self.fit.sizes.get(self.parameters[c].kind, np.inf) if c < errors else np.inf for c in columns]
        prior = np.diag(1.0 / np.square(sizes))
        place = columns.index(k)

        def spread(gram: Array) -> float:
            inverse = np.linalg.pinv(gram[np.ix_(columns, columns)] + prior, hermitian=True)
            return float(np.sqrt(max(inverse[place, place], 0.0)))

        before = spread(self.own)
        after = [spread(self.own + gram) for gram in self.joints]
        best = min(after, default=before)
        joints = [j + 1 for j, value in enumerate(after) if value < HELPS * before and value < ALIKE * best]
        return Undetermined(name=item.name, joint=item.joint, reason="poses", joints=tuple(joints))

    def _by_joint(self) -> list[Array]:
        """Information of the poses with one joint drawn over its range, per joint."""
        grams = []
        rng = np.random.default_rng(1)
        anywhere = random_positions(self.robots[0], POSES, seed=1)
        for j in range(self.robots[0].n):
            q = self.drawn.q.copy()
            q[:, j] = anywhere[:, j]
            grams.append(self._gram(_at(self.drawn, q, rng, self.robots, directions=False)))
        return grams

    def _rows(self, poses: MeasuredPoses) -> Array:
        model = GeometryModel(self.robots, self.terms, poses, reference=self._reference())
        found = model.evaluate(np.zeros(len(model.errors)), self.fit.setup)
        rows = (found.jacobian * self.scale / self.sigma[:, None]).reshape(-1, len(self.scale))
        return rows[np.isfinite(rows).all(axis=1)]

    def _gram(self, poses: MeasuredPoses) -> Array:
        rows = self._rows(poses)
        return rows.T @ rows

    def _reference(self) -> float | None:
        temperature = self.fit.model.poses.temperature
        return None if temperature is None else float(temperature.mean())


def _at(
    poses: MeasuredPoses, q: Array, rng: np.random.Generator, robots: Sequence[Robot], *, directions: bool = True
) -> MeasuredPoses:
    """The conditions of some poses at other positions."""
    second = poses.second
    if second is not None and directions:
        second = random_positions(robots[1], len(q), seed=2)
    own = poses.approach
    if own is not None and directions:
        own = approaches(rng.permutation(q))
    return replace(poses, q=q, second=second, approach=own, torque=None)
