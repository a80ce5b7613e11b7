"""The proposed next experiment as motions that a controller plays without a hand on the robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimation.diagnosis.experiment_plans.choices import repeat_stages
from estimation.diagnosis.experiment_plans.experiment_motions import MAKERS, Stage, backwards
from estimation.diagnosis.experiment_plans.next_experiment import NextExperiment
from oed.campaigns.discriminations.motions import ExperimentBuilder
from robots.base_parameters import find_base_parameters
from robots.collision import CollisionModel, check_motion
from robots.common.arrays import Array
from robots.common.errors import InfeasibleError
from robots.regressor import default_model
from robots.robot import Robot
from robots.signals import Motion
from robots.terms.effects import EXPERIMENTS


@dataclass(frozen=True, kw_only=True, eq=False)
class PlannedRun:
    """A motion from home to home.

    Attributes:
        motion: at the controller's period.
        pause: rest before it [s].
    """

    motion: Motion
    pause: float


@dataclass(frozen=True, kw_only=True, eq=False)
class PlannedExperiment:
    """What is done next.

    Attributes:
        kind: a name of `EXPERIMENTS`.
        why: in words.
        resolves: probability that it leaves one cause; None where it is not known.
        runs: its motions.
    """

    kind: str
    why: str
    resolves: float | None
    runs: tuple[PlannedRun, ...]


def plan_experiment(
    following: NextExperiment,
    robot: Robot,
    home: Array,
    played: Sequence[Motion],
    *,
    least_probability: float = 0.5,
    longest: float = np.inf,
    velocity_fraction: float = 1.0,
    bodies: CollisionModel | None = None,
    seed: int = 0,
) -> PlannedExperiment | str:
    """Makes the proposed experiment playable, or the best other kind that needs no change by hand.

    Args:
        following: what the diagnosis proposes.
        robot: the robot.
        home: pose (n,) at which motions begin and end [rad or m].
        played: motions of the logs; one that is to be repeated is played as it was.
        least_probability: of an experiment that is made.
        longest: repetitions beyond this time are left out [s].
        velocity_fraction: of the velocity limits that may be used.
        bodies: what has to stay apart in all motions; by default they are not checked for collisions.
        seed: of a random reference motion.

    Returns:
        The experiment, or why there is none.
    """
    base = find_base_parameters(default_model(robot))
    builder = ExperimentBuilder(base, home=home, velocity_fraction=velocity_fraction, seed=seed)
    options = [(following.kind, following.resolves, following.stages, following.why)]
    joint = (following.joint or 1) - 1
    for other in following.ranking:
        if other.kind != following.kind:
            stages = repeat_stages(MAKERS[other.kind](builder.room, joint, 0), other.times)
            chance = f"with {100 * other.resolves:.0f} % probability"
            why = f"{EXPERIMENTS[other.kind]}, {chance}, in place of: {following.why}"
            options.append((other.kind, other.resolves, stages, why))
    if following.resolves < least_probability:
        return following.why
    reasons = []
    for kind, resolves, stages, why in options:
        if resolves < least_probability:
            continue
        hand = by_hand(stages)
        if hand:
            reasons.append(f"{kind.replace('_', ' ')}: {hand}")
            continue
        try:
            runs = tuple(_playable(stage, kind, builder, played) for stage in within(stages, longest))
            if bodies is not None:
                _require_free(bodies, runs)
        except InfeasibleError as error:
            reasons.append(f"{kind.replace('_', ' ')}: {error}")
            continue
        return PlannedExperiment(kind=kind, why=why, resolves=resolves, runs=runs)
    return f"no proposed experiment can be played unattended ({'; '.join(reasons)}). {following.why}"


def more_data(motion: Motion) -> PlannedExperiment:
    """Repeats a motion, forwards and backwards in time, for an error that no effect explains.

    Two effects that show little each may leave a rest that neither explains. More data show both, and friction that
    depends on the direction or on the load differs on the way back.

    Args:
        motion: from rest to rest at home.
    """
    runs = tuple(PlannedRun(motion=one, pause=0.0) for one in (motion, backwards(motion)))
    why = f"{EXPERIMENTS['mirrored']}, because no cause explains the rest: two small ones may be in it"
    return PlannedExperiment(kind="mirrored", why=why, resolves=None, runs=runs)


def within(stages: Sequence[Stage], longest: float) -> tuple[Stage, ...]:
    """Leaves out repetitions of stages beyond a time; each different stage is made once at least.

    Args:
        stages: in order, repetitions one after the other.
        longest: with rests [s].
    """
    groups: list[list[Stage]] = []
    for stage in stages:
        before = groups[-1][-1] if groups else None
        if before is None or (stage.motion, stage.payload) != (before.motion, before.payload):
            groups.append([])
        groups[-1].append(stage)
    times = max(map(len, groups))
    while times > 1 and sum(s.pause + s.motion.duration for g in groups for s in g[:times]) > longest:
        times -= 1
    return tuple(stage for group in groups for stage in group[:times])


def by_hand(stages: Sequence[Stage]) -> str:
    """Names the change that somebody must make between stages; empty without any."""
    load = max(stage.payload for stage in stages)
    if load:
        return f"a payload of {load:.3g} kg must be mounted"
    return "the base must be tilted" if any(stage.gravity is not None for stage in stages) else ""


def _playable(stage: Stage, kind: str, builder: ExperimentBuilder, played: Sequence[Motion]) -> PlannedRun:
    logged = stage.motion
    back = backwards(logged)
    for motion in played:
        if repeats(logged, motion):
            return PlannedRun(motion=motion, pause=stage.pause)
        if repeats(back, motion):
            return PlannedRun(motion=backwards(motion), pause=stage.pause)
    return PlannedRun(motion=builder.run_alone(stage, kind).motion, pause=stage.pause)


def repeats(logged: Motion, played: Motion) -> bool:
    """Whether a motion is one that was played, as a log shows it.

    Args:
        logged: of a log, smoothed, perhaps cut at its end.
        played: the trajectory.
    """
    # Two motions are one where they differ by less than this share of each joint's range.
    alike = 0.05
    if logged.n != played.n or np.abs(logged.q[0] - played.q[0]).max() > alike:
        return False
    # A motion has begun where a joint is so far from its first position [rad or m].
    begins_at = 1e-3
    begins = [float(m.t[int(np.argmax(np.abs(m.q - m.q[0]).max(axis=1) > begins_at))]) for m in (logged, played)]
    t = logged.t - begins[0] + begins[1]
    rows = (t >= played.t[0]) & (t <= played.t[-1])
    if t[rows].size < 2 or np.ptp(t[rows]) < 0.5 * played.duration:
        return False
    expected = np.column_stack([np.interp(t[rows], played.t, x) for x in played.q.T])
    away = np.abs(logged.q[rows] - expected).max(axis=0)
    return bool((away <= np.maximum(alike * np.ptp(played.q, axis=0), begins_at)).all())


def _require_free(bodies: CollisionModel, runs: Sequence[PlannedRun]) -> None:
    """Raises InfeasibleError where a motion is not proved free of collisions."""
    for motion in {id(run.motion): run.motion for run in runs}.values():
        report = check_motion(bodies, motion, confirm=False)
        if not report.certified:
            raise InfeasibleError(f"its motion may collide ({report.summary()})")
