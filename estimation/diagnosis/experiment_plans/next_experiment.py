"""Next experiment to separate the remaining causes: first its kind, then its motion (T-optimality).

Coefficients and base model are refitted under the rival. What the rival leaves of a cause is then a Schur complement:
Delta = theta_A' (G_AA - G_A,[Phi,B] G^-1 G_[Phi,B],A) theta_A. G is the sum of the Gram matrices of logs and
experiment. Delta is twice the Kullback-Leibler divergence (Atkinson and Fedorov 1975).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from estimation.diagnosis.experiment_plans.choices import (
    ENOUGH,
    LIKELY,
    LONGEST,
    Choice,
    Proposal,
    combined,
    experiment_words,
    make_choice,
    repeat_stages,
    repeated,
    with_times,
)
from estimation.diagnosis.experiment_plans.experiment_grams import ARM, Cause, Grams
from estimation.diagnosis.experiment_plans.experiment_motions import MADE, MAKERS, VARIED, Stage, motion_range
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from robots.common.arrays import Array
from robots.common.forks import forked
from robots.common.records import Record
from robots.robot import Robot
from robots.signals import Motion
from robots.terms.effects import EXPERIMENTS

VARIANTS = 4
"""Number of motions tried for the best kind."""


@dataclass(frozen=True, kw_only=True)
class NextExperiment(Record):
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
        kinds: all kinds that it combines, `kind` first.
    """

    ENTRIES = ("kind", "kinds", "joint", "why", "resolves", "times", "logged", "runs", "alternatives")

    kind: str
    joint: int | None
    why: str
    resolves: float
    stages: tuple[Stage, ...] = ()
    ranking: tuple[Proposal, ...] = ()
    times: int = 1
    logged: str = ""
    kinds: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "kinds", self.kinds or (self.kind,))

    @property
    def words(self) -> str:
        """What the robot does, and how often."""
        return experiment_words(self.kind, self.times)

    @property
    def alternatives(self) -> tuple[Proposal, ...]:
        """The ranking, as files have it."""
        return self.ranking

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
    choices = forked(lambda kind: make_choice(grams, room, index, kind), MAKERS)
    if max(choice.chance for choice in choices) < ENOUGH:
        choices = [repeated(grams, choice) for choice in choices]
    ranking = sorted(choices, key=lambda choice: choice.rank)
    best = ranking[0]
    for variant in range(1, VARIANTS if best.kind in VARIED and best.chance < ENOUGH else 1):
        other = with_times(grams, make_choice(grams, room, index, best.kind, variant), best.times)
        best = min(best, other, key=lambda choice: choice.rank)
    if best.chance < LIKELY:
        best = combined(grams, best, ranking[1:])
    stages = repeat_stages(best.stages, best.times)
    # An effect that builds up or starts at one moment gives less than twice the information in twice the time.
    chance = best.chance if best.times == 1 and not best.more else grams.chance(stages)
    names = [c.hypothesis.label.replace("_", " ") for c in possible]
    why = _why(names, best, chance) + _by_hand(robot, best.stages)
    return NextExperiment(
        kind=best.kind,
        joint=joint,
        why=why,
        resolves=chance,
        stages=stages,
        ranking=tuple(choice.proposal() for choice in ranking),
        times=best.times,
        logged="" if MADE.issuperset((best.kind, *best.more)) else room.logged,
        kinds=(best.kind, *best.more),
    )


def _why(names: Sequence[str], best: Choice, chance: float) -> str:
    """Says which causes are open, what is proposed, and how likely it separates them."""
    often = f" ({best.times} times)" if best.times > 1 else ""
    proposed = _and([EXPERIMENTS[kind] for kind in (best.kind, *best.more)]) + often
    if chance >= LIKELY:
        return (
            f"{_and(names)} explain the logs about equally well. Proposed: {proposed}. It distinguishes them with "
            f"{100 * chance:.0f} % probability"
        )
    pair = np.unravel_index(int(np.argmin(best.chances)), best.chances.shape)
    close = _and([names[int(k)] for k in sorted(pair)])
    rest = "; it may distinguish the others" if len(names) > 2 else ""
    return (
        f"No experiment of the known kinds is likely to distinguish {close}: with these sizes their torques differ by "
        f"less than the noise in each of them, also in {LONGEST:.0f} s. The best is {proposed}, with "
        f"{100 * chance:.0f} % probability{rest}"
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
    return f"{', '.join(names[:-1])} and {names[-1]}" if len(names) > 1 else names[0]


# Shapes tried around a fitted one: factors for logarithmic parameters, shares of the range for others.
FACTORS, SHARES = (0.5, 0.7, 1.4, 2.0), (-0.25, -0.1, 0.1, 0.25)
# Approximate number of grid points that are tried as well.
POINTS = 16


@dataclass(frozen=True, eq=False)
class RivalShape:
    """A cause with another shape than the fitted one.

    Attributes:
        hypothesis: effect and joint.
        shape: its shape parameters.
        coefficients: zeros (k,); they are refitted.
    """

    hypothesis: Hypothesis
    shape: tuple[float, ...]
    coefficients: Array


def find_rival_shapes(problem: Problem, causes: Sequence[Cause]) -> list[tuple[int, RivalShape]]:
    """Finds for each pair of causes the shape of the rival that leaves the least of the true cause on the logs.

    Args:
        problem: the logs.
        causes: the possible causes with their fitted shapes.

    Returns:
        Index of the cause, and its other shape, where that resembles another cause more than the fitted shape does.
    """
    forms = [
        (k, RivalShape(cause.hypothesis, shape, np.zeros(len(cause.coefficients))))
        for k, cause in enumerate(causes)
        for shape in _shapes(problem, cause)
    ]
    if not forms:
        return []
    grams = Grams(problem, causes, forms)
    chosen = set()
    for true in range(len(causes)):
        for rival in set(range(len(causes))) - {true}:
            own = [k for k, owner in enumerate(grams.owners) if owner == rival]
            best = min(own, key=lambda k: grams.left(grams.old, true, k))
            if best >= len(causes):
                chosen.add(best)
    return [forms[k - len(causes)] for k in sorted(chosen)]


def _shapes(problem: Problem, cause: Cause) -> Iterator[tuple[float, ...]]:
    effect, joint = cause.hypothesis.effect, cause.hypothesis.joint
    state = problem.state_for(effect)
    seen = {cause.shape}
    for shape in (*_around(problem, cause), *_spread(effect.grid(state, joint))):
        # A change time in the logs has no meaning in a new experiment.
        kept = tuple(
            own if s.moment else value for s, own, value in zip(effect.shapes, cause.shape, shape, strict=True)
        )
        if kept not in seen:
            seen.add(kept)
            yield kept


def _around(problem: Problem, cause: Cause) -> Iterator[tuple[float, ...]]:
    effect = cause.hypothesis.effect
    bounds = effect.bounds(problem.state_for(effect), cause.hypothesis.joint)
    for k, ((low, high), shape, value) in enumerate(zip(bounds, effect.shapes, cause.shape, strict=True)):
        if not high > low or shape.choices or shape.is_left(value):
            continue
        near = [value * f for f in FACTORS]
        if shape.scale == "linear" and np.isfinite(high - low):
            near = [value + share * (high - low) for share in SHARES]
        for other in near:
            yield (*cause.shape[:k], float(np.clip(other, low, high)), *cause.shape[k + 1 :])


def _spread(grid: Sequence[tuple[float, ...]]) -> Sequence[tuple[float, ...]]:
    return grid[:: max(1, -(-len(grid) // POINTS))]
