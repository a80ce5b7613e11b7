"""Which experiment would tell the causes that are left apart: its kind first, then its motion (T-optimality).

With the linear coefficients and the base model refitted under the rival, what the rival leaves of a cause is a Schur
complement: Delta = theta_A' (G_AA - G_A,[Phi,B] G^-1 G_[Phi,B],A) theta_A, G the sum of the Gram matrices of the logs
there are and of the experiment. It equals the Kullback-Leibler divergence times two (Atkinson and Fedorov 1975).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.carried import point_mass, regressor_on, unloaded, with_body
from estimation.diagnosis.gaps import no_gaps
from estimation.diagnosis.hypotheses import Hypothesis
from estimation.diagnosis.next_experiment_motions import MAKERS, VARIED, Stage, room_of
from estimation.diagnosis.power import chance_to_resolve
from estimation.diagnosis.problem import Problem
from estimation.diagnosis.whitening import Whitening
from robots.base_parameters import find_base_parameters
from robots.regressor import TorqueModel
from robots.signals import Motion
from robots.terms.effects import EXPERIMENTS, situation
from robots.terms.effects.base_tilt import level_axes
from robots.terms.effects.situation import joined

Array = NDArray[np.float64]

VARIANTS = 4
"""Motions that are tried of the best kind."""
LATER = 3600.0
"""Time from the logs to the experiment [s]: the robot has cooled."""
ARM = 0.1
"""Distance of a payload's centre from the flange [m]."""
ENOUGH = 0.95
"""Chance beyond which the least trouble decides."""


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


@dataclass(frozen=True, kw_only=True)
class Proposal:
    """One kind of experiment, judged.

    Attributes:
        kind: a name of `EXPERIMENTS`.
        resolves: chance that it leaves one cause.
        duration: with pauses [s].
    """

    kind: str
    resolves: float
    duration: float


@dataclass(frozen=True, kw_only=True)
class NextExperiment:
    """The experiment to make next.

    Attributes:
        kind: a name of `EXPERIMENTS`.
        joint: the joint that it is about, from 1; None for all.
        why: one sentence for people.
        resolves: chance that it leaves one cause.
        stages: motions with their pauses, payloads and base poses; without a pose of its own, the base stands as in the
            last log.
        ranking: all kinds, the best first.
    """

    kind: str
    joint: int | None
    why: str
    resolves: float
    stages: tuple[Stage, ...]
    ranking: tuple[Proposal, ...]

    def to_dict(self) -> dict[str, Any]:
        """Writes it as plain data, without the motions."""
        return {
            "kind": self.kind,
            "joint": self.joint,
            "why": self.why,
            "resolves": self.resolves,
            "alternatives": [{"kind": p.kind, "resolves": p.resolves, "duration": p.duration} for p in self.ranking],
        }


def plan_next(problem: Problem, causes: Sequence[Cause]) -> NextExperiment | None:
    """Finds the experiment that tells possible causes apart.

    Args:
        problem: the logs there are.
        causes: two or more, the likeliest first; beyond four, the likeliest four.

    Returns:
        The experiment; None for fewer than two causes.
    """
    possible = list(causes)[:4]
    if len(possible) < 2:
        return None
    robot = problem.situation.robot.under(problem.recording.gravities[-1])
    joint = next((c.hypothesis.joint for c in possible if c.hypothesis.joint is not None), None)
    index = joint - 1 if joint is not None else int(np.argmax(np.ptp(problem.recording.q, axis=0)))
    room = room_of(robot, problem.recording)
    grams = Grams(problem, possible)
    proposals, made = [], {}
    for kind, make in MAKERS.items():
        stages = make(room, index, 0)
        made[kind] = (stages, grams.chance(stages))
        proposals.append(Proposal(kind=kind, resolves=made[kind][1], duration=_duration(stages)))
    # Of those that are sure enough the first is the least trouble; else the surest.
    ranking = sorted(proposals, key=lambda p: -min(p.resolves, ENOUGH))
    kind = ranking[0].kind
    best, chance = made[kind]
    for variant in range(1, VARIANTS if kind in VARIED and chance < ENOUGH else 1):
        stages = MAKERS[kind](room, index, variant)
        better = grams.chance(stages)
        if better > chance:
            best, chance = stages, better
    names = [c.hypothesis.label.replace("_", " ") for c in possible]
    why = (
        f"{', '.join(names[:-1])} and {names[-1]} explain the logs about equally well; {EXPERIMENTS[kind]} would tell "
        f"them apart with a chance of {100 * chance:.0f} %"
    )
    return NextExperiment(kind=kind, joint=joint, why=why, resolves=chance, stages=best, ranking=tuple(ranking))


def _duration(stages: Sequence[Stage]) -> float:
    return float(sum(stage.pause + stage.motion.duration for stage in stages))


class Grams:
    """Gram matrices of base columns and all causes' columns, whitened: of the logs, and of any experiment."""

    def __init__(self, problem: Problem, causes: Sequence[Cause]) -> None:
        self.problem = problem
        self.causes = causes
        self.model: TorqueModel = problem.situation.model
        # A base that is tilted shows parameters that the logs do not: they take a part of what it shows of a cause.
        gravity = np.asarray(self.model.robot.chain.gravity, dtype=float)
        fields = [field for field in problem.recording.fields if field is not None]
        tilted = [gravity + np.linalg.norm(gravity) * axis for axis in level_axes(gravity)] if gravity.any() else []
        self.base = find_base_parameters(self.model, gravities=[*fields, *tilted])
        self.columns = self.base.independent
        self.sizes = [len(c.coefficients) for c in causes]

    @cached_property
    def old(self) -> Array:
        """Of the logs that there are."""
        now = self.problem.situation
        effects = [c.hypothesis.effect.columns(now, c.hypothesis.joint, c.shape) for c in self.causes]
        return self._gram(regressor_on(self.base, self.problem.recording), effects, self.problem.whitening)

    def chance(self, stages: Sequence[Stage]) -> float:
        """Gives the chance that each cause, were it true, would be told from every other."""
        total = self.old + self.of(stages, float(self.problem.recording.t[-1]) + LATER)
        return min(
            chance_to_resolve(self._left(total, true, rival))
            for true in range(len(self.causes))
            for rival in range(len(self.causes))
            if true != rival
        )

    def of(self, stages: Sequence[Stage], begin: float = 0.0) -> Array:
        """Evaluates an experiment that begins at a time [s] of the logs' clock: the Gram matrix of all columns."""
        bases: list[Array] = []
        effects: list[list[Array]] = [[] for _ in self.causes]
        starts: list[int] = []
        t0, rows = begin, 0
        for part in _joined(stages):
            model = self.model.under(self.problem.recording.gravities[-1] if part.gravity is None else part.gravity)
            motion = (part.motion.q, part.motion.dq, part.motion.ddq)
            carried = self._parameters(part.payload)
            played = situation(model, carried, t0 + part.motion.t, *motion, starts=part.starts)
            now = joined([played], self.model)
            bases.append(model.regressor(now.q, now.dq, now.ddq, columns=self.columns))
            for columns, cause in zip(effects, self.causes, strict=True):
                columns.append(cause.hypothesis.effect.columns(now, cause.hypothesis.joint, cause.shape))
            starts += [rows + s for s in part.starts]
            rows += len(part.motion)
            t0 = float(now.t[-1]) + 60.0
        base = np.concatenate(bases)
        plain = replace(self.problem.whitening, gaps=no_gaps(base.shape[1]), weights=None, levels=None)
        whitening = replace(plain, starts=tuple(starts))
        return self._gram(base, [np.concatenate(parts) for parts in effects], whitening)

    def block(self, gram: Array, cause: int) -> Array:
        """The energy of a cause's columns (k, k), nothing projected out."""
        edges = len(self.columns) + np.concatenate([[0], np.cumsum(self.sizes)])
        own = slice(int(edges[cause]), int(edges[cause + 1]))
        return gram[own, own]

    def _parameters(self, payload: float) -> Array:
        return with_body(self.model, unloaded(self.problem), point_mass(payload, (0.0, 0.0, ARM)))

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

    def _left(self, gram: Array, true: int, rival: int) -> float:
        theta = self.causes[true].coefficients
        return max(float(theta @ self.remainder(gram, true, rival) @ theta), 0.0)

    def remainder(self, gram: Array, true: int, rival: int | None) -> Array:
        """What base model and rival, or the base model alone, leave of the true cause's columns (k, k)."""
        b = len(self.columns)
        edges = b + np.concatenate([[0], np.cumsum(self.sizes)])
        own = np.arange(edges[true], edges[true + 1])
        beside = np.arange(b)
        if rival is not None:
            beside = np.concatenate([beside, np.arange(edges[rival], edges[rival + 1])])
        scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
        unit = gram / scale[:, None] / scale
        values, vectors = np.linalg.eigh(unit[np.ix_(beside, beside)])
        kept = values > 1e-9 * values[-1]
        cross = unit[np.ix_(own, beside)] @ vectors[:, kept] / np.sqrt(values[kept])
        left: Array = (unit[np.ix_(own, own)] - cross @ cross.T) * np.outer(scale[own], scale[own])
        return left


@dataclass(frozen=True, eq=False)
class _Part:
    """Stages that only pauses part."""

    motion: Motion
    starts: tuple[int, ...]
    payload: float
    gravity: Array | None


def _joined(stages: Sequence[Stage]) -> list[_Part]:
    """Joins stages of one payload and base pose: heat passes from one to the next."""
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
