"""Which experiment would tell the causes that are left apart: its kind first, then its motion (T-optimality).

With the linear coefficients and the base model refitted under the rival, what the rival leaves of a cause is a Schur
complement: Delta = theta_A' (G_AA - G_A,[Phi,B] G^-1 G_[Phi,B],A) theta_A, G the sum of the Gram matrices of the logs
there are and of the experiment. It equals the Kullback-Leibler divergence times two (Atkinson and Fedorov 1975).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.experiment_plans.experiment_grams import ARM, Cause, Grams
from estimation.diagnosis.experiment_plans.experiment_motions import (
    MADE,
    MAKERS,
    VARIED,
    MotionRange,
    Stage,
    motion_range,
)
from estimation.diagnosis.experiment_plans.rival_shapes import find_rival_shapes
from estimation.diagnosis.hypothesis_tests.problem import Problem
from robots.robot import Robot
from robots.signals import Motion
from robots.terms.effects import EXPERIMENTS

Array = NDArray[np.float64]

VARIANTS = 4
"""Motions that are tried of the best kind."""
ENOUGH = 0.99
"""Chance beyond which the least trouble decides: causes are true to some per cent, and the chance knows noise alone."""
TIE = 0.01
"""Weight of the mean chance over all pairs of causes beside the least one."""
HOPELESS = 0.2
"""Chance below which two causes are said to stay alike."""
TIMES, LONGEST = (2, 4, 8, 16), 300.0
"""How often motions are made where once does not do, and how long an experiment may last then [s], with pauses."""


@dataclass(frozen=True, kw_only=True)
class Proposal:
    """One kind of experiment, judged.

    Attributes:
        kind: a name of `EXPERIMENTS`.
        resolves: chance that it leaves one cause.
        duration: with pauses [s].
        times: how often its motions are made, one after the other.
    """

    kind: str
    resolves: float
    duration: float
    times: int = 1


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
        times: how often each motion is made, one after the other; all are among the stages.
        logged: which motion of the logs is repeated, in words; empty where the motions are new.
    """

    kind: str
    joint: int | None
    why: str
    resolves: float
    stages: tuple[Stage, ...]
    ranking: tuple[Proposal, ...]
    times: int = 1
    logged: str = ""

    @property
    def motions(self) -> tuple[Motion, ...]:
        """Its different motions, in the order in which they are first made."""
        return tuple(dict.fromkeys(stage.motion for stage in self.stages))

    @property
    def runs(self) -> list[dict[str, Any]]:
        """What to play, one after the other: the motion's number from 1, the rest before it, payload and base pose."""
        numbers = {motion: number for number, motion in enumerate(self.motions, start=1)}
        return [
            {
                "motion": numbers[stage.motion],
                "pause_s": stage.pause,
                "payload_kg": stage.payload,
                "gravity": None if stage.gravity is None else [float(g) for g in stage.gravity],
            }
            for stage in self.stages
        ]

    def to_dict(self) -> dict[str, Any]:
        """Writes it as plain data, without the motions."""
        return {
            "kind": self.kind,
            "joint": self.joint,
            "why": self.why,
            "resolves": self.resolves,
            "times": self.times,
            "logged": self.logged,
            "runs": self.runs,
            "alternatives": [
                {"kind": p.kind, "resolves": p.resolves, "duration": p.duration, "times": p.times} for p in self.ranking
            ],
        }


@dataclass(frozen=True, eq=False)
class _Choice:
    """A kind of experiment, its motions made so often; what they tell (b + k, b + k), and of which cause (K, K)."""

    kind: str
    stages: tuple[Stage, ...]
    grams: tuple[Array, ...]
    chances: Array
    times: int = 1

    @property
    def chance(self) -> float:
        """That it leaves one cause, whichever it is."""
        return float(self.chances.min())

    @property
    def rank(self) -> tuple[float, int]:
        """The least first: of those that are sure enough the least trouble, else the surest.

        Where two causes stay alike whatever is done, the one that tells the others apart.
        """
        if self.chance >= ENOUGH:
            return -ENOUGH, self.times
        return -(1.0 - TIE) * self.chance - TIE * float(self.chances.mean()), self.times

    @property
    def duration(self) -> float:
        """With pauses [s]."""
        return float(sum(stage.pause + stage.motion.duration for stage in repeat_stages(self.stages, self.times)))

    def proposal(self) -> Proposal:
        return Proposal(kind=self.kind, resolves=self.chance, duration=self.duration, times=self.times)


def plan_next(problem: Problem, causes: Sequence[Cause]) -> NextExperiment | None:
    """Finds the experiment that tells possible causes apart.

    Where none does that its motions are made once for, they are made several times.

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
    room = motion_range(robot, problem.recording)
    grams = Grams(problem, possible, find_rival_shapes(problem, possible))
    choices = [_made(grams, room, index, kind) for kind in MAKERS]
    if max(choice.chance for choice in choices) < ENOUGH:
        choices = [_longer(grams, choice) for choice in choices]
    ranking = sorted(choices, key=lambda choice: choice.rank)
    best = ranking[0]
    for variant in range(1, VARIANTS if best.kind in VARIED and best.chance < ENOUGH else 1):
        other = _times(grams, _made(grams, room, index, best.kind, variant), best.times)
        best = min(best, other, key=lambda choice: choice.rank)
    stages = repeat_stages(best.stages, best.times)
    # What builds up or comes at a moment does not tell twice as much in twice the time.
    chance = best.chance if best.times == 1 else grams.chance(stages)
    names = [c.hypothesis.label.replace("_", " ") for c in possible]
    often = f" ({best.times} times)" if best.times > 1 else ""
    why = f"{_and(names)} explain the logs about equally well. Proposed: {EXPERIMENTS[best.kind]}{often}. "
    if len(possible) > 2 and chance < HOPELESS:
        alike = np.unravel_index(int(np.argmin(best.chances)), best.chances.shape)
        close = _and([names[k] for k in sorted(alike)])
        why += (
            f"It distinguishes most of them, but {close} only with {100 * chance:.0f} % probability; no tested "
            "experiment is better"
        )
    else:
        why += f"It distinguishes them with {100 * chance:.0f} % probability"
    why += _by_hand(robot, best.stages)
    return NextExperiment(
        kind=best.kind,
        joint=joint,
        why=why,
        resolves=chance,
        stages=stages,
        ranking=tuple(choice.proposal() for choice in ranking),
        times=best.times,
        logged="" if best.kind in MADE else room.logged,
    )


def _by_hand(robot: Robot, stages: Sequence[Stage]) -> str:
    """Says what is to be hung on the flange, and by how much the base is to be tilted; nothing where neither is."""
    load = max(stage.payload for stage in stages)
    down = np.asarray(robot.chain.gravity, dtype=float)
    angles = [float(np.arccos(_along(down, stage.gravity))) for stage in stages if stage.gravity is not None]
    payload = f"; payload {load:.2g} kg, {ARM:g} m from the flange" if load else ""
    return payload + (f"; base tilted by {np.degrees(max(angles)):.0f} deg" if angles else "")


def _along(one: Array, other: Array) -> float:
    return float(np.clip(one @ other / max(float(np.linalg.norm(one) * np.linalg.norm(other)), 1e-300), -1.0, 1.0))


def _and(names: Sequence[str]) -> str:
    return f"{', '.join(names[:-1])} and {names[-1]}"


def repeat_stages(stages: Sequence[Stage], times: int) -> tuple[Stage, ...]:
    """Makes each stage so often, one after the other; what is changed before it, such as a payload, is changed once."""
    again = [replace(stage, pause=Stage.pause) for stage in stages]
    return tuple(part for stage, other in zip(stages, again, strict=True) for part in (stage, *(other,) * (times - 1)))


def _made(grams: Grams, room: MotionRange, joint: int, kind: str, variant: int = 0) -> _Choice:
    stages = MAKERS[kind](room, joint, variant)
    later = grams.later(stages)
    return _Choice(kind, stages, later, grams.chances_of(later))


def _times(grams: Grams, choice: _Choice, times: int) -> _Choice:
    return replace(choice, times=times, chances=grams.chances_of(choice.grams, times))


def _longer(grams: Grams, choice: _Choice) -> _Choice:
    """Makes an experiment's motions as often as it takes, if it may last so long."""
    best = choice
    for times in TIMES:
        more = _times(grams, choice, times)
        if best.chance >= ENOUGH or more.duration > LONGEST:
            break
        best = more
    return best
