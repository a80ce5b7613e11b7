"""Next experiment to separate the remaining causes: first its kind, then its motion (T-optimality).

Coefficients and base model are refitted under the rival. What the rival leaves of a cause is then a Schur complement:
Delta = theta_A' (G_AA - G_A,[Phi,B] G^-1 G_[Phi,B],A) theta_A. G is the sum of the Gram matrices of logs and
experiment. Delta is twice the Kullback-Leibler divergence (Atkinson and Fedorov 1975).
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
"""Number of motions tried for the best kind."""
ENOUGH = 0.99
"""Probability from which the simplest experiment is chosen. Models of causes hold to some per cent, and the probability
includes noise only."""
TIE = 0.01
"""Weight of the mean probability over all pairs of causes, added to the smallest one."""
HOPELESS = 0.2
"""Probability below which two causes are reported as not separable."""
TIMES, LONGEST = (2, 4, 8, 16), 300.0
"""Numbers of repetitions tried if once is not enough, and the longest experiment then [s], with pauses."""


@dataclass(frozen=True, kw_only=True)
class Proposal:
    """One kind of experiment and its evaluation.

    Attributes:
        kind: a name of `EXPERIMENTS`.
        resolves: probability that it leaves one cause.
        duration: with pauses [s].
        times: how often each motion is made.
    """

    kind: str
    resolves: float
    duration: float
    times: int = 1


@dataclass(frozen=True, kw_only=True)
class NextExperiment:
    """The proposed experiment.

    Attributes:
        kind: a name of `EXPERIMENTS`.
        joint: joint to which it applies, from 1; None for all.
        why: reason in one or two sentences.
        resolves: probability that it leaves one cause.
        stages: motions with pauses, payloads and base poses, repetitions included. Without a pose of its own, the base
            stands as in the last log.
        ranking: all kinds, the best first.
        times: how often each motion is made.
        logged: which motion of the logs is repeated, in words; empty for new motions.
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
        """Its different motions, in the order of their first use."""
        return tuple(dict.fromkeys(stage.motion for stage in self.stages))

    @property
    def runs(self) -> list[dict[str, Any]]:
        """Runs in their order: number of the motion from 1, pause before it, payload and base pose."""
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
        """Returns plain data, without the motions."""
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
    """A kind of experiment with its Gram matrices (b + k, b + k), and the probabilities to separate causes (K, K)."""

    kind: str
    stages: tuple[Stage, ...]
    grams: tuple[Array, ...]
    chances: Array
    times: int = 1

    @property
    def chance(self) -> float:
        """Probability that it leaves one cause, for the least favourable true cause."""
        return float(self.chances.min())

    @property
    def rank(self) -> tuple[float, int]:
        """Sort key: sufficiently certain kinds first, by their repetitions, then the others by their probability.

        The mean probability decides where two causes are never separable.
        """
        if self.chance >= ENOUGH:
            return -ENOUGH, self.times
        return -(1.0 - TIE) * self.chance - TIE * float(self.chances.mean()), self.times

    @property
    def duration(self) -> float:
        """Duration with pauses [s]."""
        return float(sum(stage.pause + stage.motion.duration for stage in repeat_stages(self.stages, self.times)))

    def proposal(self) -> Proposal:
        return Proposal(kind=self.kind, resolves=self.chance, duration=self.duration, times=self.times)


def plan_next(problem: Problem, causes: Sequence[Cause]) -> NextExperiment | None:
    """Finds the experiment that separates the possible causes.

    If no kind does so when its motions are made once, they are repeated.

    Args:
        problem: the logs.
        causes: two or more, the most likely first; only the first four are used.

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
    # An effect that builds up or starts at one moment gives less than twice the information in twice the time.
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
    """Describes the payload to attach and the tilt of the base; empty without both."""
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
    """Repeats each stage; a manual change before it, such as a payload, is made once.

    Args:
        stages: stages of one repetition.
        times: how often each is made.
    """
    again = [replace(stage, pause=Stage.pause) for stage in stages]
    return tuple(part for stage, other in zip(stages, again, strict=True) for part in (stage, *(other,) * (times - 1)))


def _made(grams: Grams, room: MotionRange, joint: int, kind: str, variant: int = 0) -> _Choice:
    stages = MAKERS[kind](room, joint, variant)
    later = grams.later(stages)
    return _Choice(kind, stages, later, grams.chances_of(later))


def _times(grams: Grams, choice: _Choice, times: int) -> _Choice:
    return replace(choice, times=times, chances=grams.chances_of(choice.grams, times))


def _longer(grams: Grams, choice: _Choice) -> _Choice:
    """Repeats an experiment's motions until it is certain enough or too long."""
    best = choice
    for times in TIMES:
        more = _times(grams, choice, times)
        if best.chance >= ENOUGH or more.duration > LONGEST:
            break
        best = more
    return best
