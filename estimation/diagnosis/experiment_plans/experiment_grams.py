"""Gram matrices of base model and causes, for logs and for planned motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import Protocol

import numpy as np

from estimation.diagnosis.base_models.payload_and_gravity import base_regressor
from estimation.diagnosis.experiment_plans.experiment_motions import Stage
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.power import chance_to_resolve
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.noise_models.masked_rows import no_masked_rows
from estimation.diagnosis.noise_models.whitening import Whitening
from estimation.linear_algebra.scaled import inverse_root
from robots.base_parameters import find_base_parameters
from robots.common.arrays import Array
from robots.regressor import TorqueModel
from robots.signals import Motion
from robots.terms.effect_bases.heat import HeatEffect
from robots.terms.effects import situation
from robots.terms.effects.base_tilt import level_axes
from robots.terms.situations.flange_body import point_mass, with_body
from robots.terms.situations.joining import join_situations
from robots.terms.situations.situation import Situation

SOON, LATER = 2.0, 3600.0
"""Times from the logs to the experiment [s]: the robot is still warm, or has cooled. Which one holds is not known."""
WARMING = 25
"""Stride of log samples from which the heat at the end of the logs is computed."""
ARM = 0.1
"""Distance of a payload's centre from the flange [m]."""


class Cause(Protocol):
    """A possible cause: an effect with its fitted shape and coefficients."""

    @property
    def hypothesis(self) -> Hypothesis:
        """Effect and joint."""

    @property
    def shape(self) -> tuple[float, ...]:
        """Its shape parameters."""

    @property
    def coefficients(self) -> Array:
        """Its coefficients (k,)."""


class Grams:
    """Whitened Gram matrices of the base columns and all causes' columns, of the logs and of any experiment.

    Args:
        problem: the logs.
        causes: the K possible causes.
        forms: other shapes of a cause, each with the index of the cause. A rival takes the shape that resembles most.
    """

    def __init__(self, problem: Problem, causes: Sequence[Cause], forms: Sequence[tuple[int, Cause]] = ()) -> None:
        self.problem = problem
        self.causes = causes
        self.every = [*causes, *(form for _, form in forms)]
        self.owners = [*range(len(causes)), *(owner for owner, _ in forms)]
        self.model: TorqueModel = problem.situation.model
        # A tilted base shows base parameters that the logs do not. They absorb part of a cause's torque.
        gravity = np.asarray(self.model.robot.chain.gravity, dtype=float)
        fields = [field for field in problem.recording.gravity_fields if field is not None]
        tilted = [gravity + np.linalg.norm(gravity) * axis for axis in level_axes(gravity)] if gravity.any() else []
        self.base = find_base_parameters(self.model, gravities=[*fields, *tilted])
        self.columns = self.base.independent
        self.sizes = [len(c.coefficients) for c in self.every]

    @cached_property
    def old(self) -> Array:
        """Gram matrix of the logs."""
        now = self.problem.situation
        effects = [c.hypothesis.effect.columns(now, c.hypothesis.joint, c.shape) for c in self.every]
        return self._gram(base_regressor(self.base, self.problem.recording), effects, self.problem.whitening)

    @cached_property
    def heated(self) -> bool:
        """Whether a cause depends on the temperature at which the logs left the robot."""
        return any(isinstance(c.hypothesis.effect, HeatEffect) for c in self.every)

    def chance(self, stages: Sequence[Stage]) -> float:
        """Returns the probability that the true cause is separated from all rivals, for the least favourable pair.

        Args:
            stages: the experiment.
        """
        return float(self.chances_of(self.later(stages)).min())

    def later(self, stages: Sequence[Stage]) -> tuple[Array, ...]:
        """Returns the Gram matrices of an experiment after the logs: with cold joints, and with warm ones if needed."""
        end = float(self.problem.recording.t[-1])
        cold = self.of(stages, end + LATER)
        return (cold, self.of(stages, end + SOON, warm=True)) if self.heated else (cold,)

    def chances_of(self, new: Sequence[Array], times: int = 1) -> Array:
        """Returns the probability that a true cause (row) is separated from a rival (column).

        Args:
            new: Gram matrices of the experiment in several conditions; the least favourable counts.
            times: how often the experiment is made.

        Returns:
            (K, K), 1 on the diagonal.
        """
        result = np.ones((len(self.causes),) * 2)
        for gram in new:
            total = self.old + times * gram
            for true, (form, rival) in product(range(len(self.causes)), enumerate(self.owners)):
                if rival != true:
                    chance = chance_to_resolve(self.left(total, true, form))
                    result[true, rival] = min(result[true, rival], chance)
        return result

    def of(self, stages: Sequence[Stage], begin: float = 0.0, *, warm: bool = False) -> Array:
        """Returns the Gram matrix of all columns in an experiment.

        Args:
            stages: the experiment.
            begin: its start on the logs' clock [s].
            warm: whether joints are as warm as after the logs, until the payload or base pose changes; cold by default.
        """
        bases: list[Array] = []
        effects: list[list[Array]] = [[] for _ in self.every]
        starts: list[int] = []
        t0, rows = begin, 0
        for number, part in enumerate(_joined(stages)):
            model = self.model.under(self.problem.recording.gravities[-1] if part.gravity is None else part.gravity)
            before = self._logged if warm and not number else None
            played, first = self._played(model, part, t0, before)
            now = join_situations([played], self.model)
            bases.append(model.regressor(now.q[first:], now.dq[first:], now.ddq[first:], columns=self.columns))
            for columns, cause in zip(effects, self.every, strict=True):
                values = cause.hypothesis.effect.columns(now, cause.hypothesis.joint, cause.shape)
                columns.append(values[first:])
            starts += [rows + s for s in part.starts]
            rows += len(part.motion)
            t0 = float(now.t[-1]) + 60.0
        base = np.concatenate(bases)
        plain = replace(self.problem.whitening, masked=no_masked_rows(base.shape[1]), weights=None, levels=None)
        whitening = replace(plain, starts=tuple(starts))
        return self._gram(base, [np.concatenate(parts) for parts in effects], whitening)

    def block(self, gram: Array, cause: int) -> Array:
        """Returns the Gram matrix of one cause's columns (k, k), with nothing projected out."""
        edges = len(self.columns) + np.concatenate([[0], np.cumsum(self.sizes)])
        own = slice(int(edges[cause]), int(edges[cause + 1]))
        return gram[own, own]

    @cached_property
    def _logged(self) -> tuple[Motion, tuple[int, ...]]:
        """Thinned motion of the logs, and the start of each log, from which the heat is computed."""
        recording = self.problem.recording
        rows = np.concatenate([np.arange(run.start, run.stop, WARMING) for run in recording.runs])
        starts = np.searchsorted(rows, recording.starts)
        motion = Motion(recording.t[rows], recording.q[rows], recording.dq[rows], recording.ddq[rows])
        return motion, tuple(int(s) for s in starts)

    def _played(
        self, model: TorqueModel, part: _Part, begin: float, before: tuple[Motion, tuple[int, ...]] | None
    ) -> tuple[Situation, int]:
        """Evaluates a part of an experiment, after the logs if given; also returns the row at which it starts."""
        motion, starts, first = part.motion, part.starts, 0
        t = begin + motion.t
        if before is not None:
            logged, ahead = before
            first = len(logged)
            t = np.concatenate([logged.t, t])
            motion = Motion.concatenate([logged, Motion(t[first:], motion.q, motion.dq, motion.ddq)])
            starts = (*ahead, *(first + s for s in starts))
        parameters = self._parameters(part.payload)
        return situation(model, parameters, t, motion.q, motion.dq, motion.ddq, starts=starts), first

    def _parameters(self, payload: float) -> Array:
        return with_body(self.model, self.problem.parameters_without_payload, point_mass(payload, (0.0, 0.0, ARM)))

    def _gram(self, base: Array, effects: Sequence[Array], whitening: Whitening) -> Array:
        joined = np.concatenate([base, *effects], axis=2)
        white = [whitening.apply(np.ascontiguousarray(joined[:, j]), j) for j in range(joined.shape[1])]
        P = whitening.precision
        gram = np.zeros((joined.shape[2],) * 2)
        for j, first in enumerate(white):
            gram += P[j, j] * (first.T @ first)
            for k in range(j):
                if P[j, k]:
                    part = P[j, k] * (first.T @ white[k])
                    gram += part + part.T
        return gram

    def left(self, gram: Array, true: int, rival: int) -> float:
        """Returns the energy of the true cause that a rival, in one of its shapes, does not absorb.

        Args:
            gram: Gram matrix of all columns.
            true: index of the true cause.
            rival: index of the rival's shape among causes and forms.
        """
        theta = self.causes[true].coefficients
        return max(float(theta @ self.remainder(gram, true, rival) @ theta), 0.0)

    def remainder(self, gram: Array, true: int, rival: int | None) -> Array:
        """Returns the Gram matrix (k, k) of the true cause with base model and rival projected out.

        Args:
            gram: Gram matrix of all columns.
            true: index of the true cause.
            rival: index of the rival's shape among causes and forms; None for the base model alone.
        """
        b = len(self.columns)
        edges = b + np.concatenate([[0], np.cumsum(self.sizes)])
        own = np.arange(edges[true], edges[true + 1])
        beside = np.arange(b)
        if rival is not None:
            beside = np.concatenate([beside, np.arange(edges[rival], edges[rival + 1])])
        cross = gram[np.ix_(own, beside)] @ inverse_root(gram[np.ix_(beside, beside)], 1e-9)
        return np.asarray(gram[np.ix_(own, own)] - cross @ cross.T)


@dataclass(frozen=True, eq=False)
class _Part:
    """Stages with the same payload and base pose, separated by pauses only."""

    motion: Motion
    starts: tuple[int, ...]
    payload: float
    gravity: Array | None


def _joined(stages: Sequence[Stage]) -> list[_Part]:
    """Joins stages of one payload and base pose, between which heat remains."""
    parts: list[tuple[list[Motion], float, Array | None]] = []
    for stage in stages:
        same = parts and parts[-1][1] == stage.payload and parts[-1][2] is stage.gravity
        if not same:
            parts.append(([stage.motion], stage.payload, stage.gravity))
            continue
        before = parts[-1][0][-1]
        m = stage.motion
        parts[-1][0].append(Motion(m.t + float(before.t[-1]) + stage.pause, m.q, m.dq, m.ddq))
    result = []
    for motions, carried, gravity in parts:
        starts = tuple(int(s) for s in np.cumsum([0, *(len(m) for m in motions[:-1])]))
        result.append(_Part(Motion.concatenate(motions), starts, carried, gravity))
    return result
