"""Design of an experiment that distinguishes two possible causes, before any log exists.

Of each kind of experiment, T-optimality asks how much of either cause base model and rival would leave in the noise
(Atkinson and Fedorov 1975): here of the very motion that is written, the reference included.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimation.diagnosis.experiment_plans.experiment_motions import MAKERS, VARIED, MotionRange, Stage
from estimation.diagnosis.experiment_plans.next_experiment import VARIANTS
from estimation.diagnosis.experiment_plans.planned_limits import planned_problem
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from oed.campaigns.discriminations.clear_runs import ClearRuns
from oed.campaigns.discriminations.discrimination import Discrimination, DiscriminationScore
from oed.campaigns.discriminations.motions import ExperimentBuilder, Run
from oed.campaigns.discriminations.probabilities import STEP, Discriminator, require_separable
from oed.campaigns.discriminations.rivals import parse_rivals
from oed.experiments.assembly import rest_pose
from oed.experiments.checks import velocity_share
from oed.experiments.options import LimitOptions
from oed.experiments.safety_checks.safety import choose_safety
from robots.base_parameters import find_base_parameters
from robots.collision import Surroundings
from robots.common.errors import InfeasibleError, InputError, NotIdentifiableError
from robots.common.progress import SILENT, Progress
from robots.plants import Sensors
from robots.regressor import default_model
from robots.robot import Robot
from robots.terms.effects import EFFECTS, EXPERIMENTS

Array = NDArray[np.float64]

REFERENCES = 6
"""Largest number of random reference motions; the most informative one is used."""
SHARE = 0.02
"""Noise as a share of each joint's torque RMS, where it is not stated."""
SHARP = 1e-3
"""Velocity [rad/s or m/s] at which the planned model's friction turns round."""


def discriminate(
    robot: Robot,
    rivals: str | Sequence[str],
    *,
    noise: ArrayLike | None = None,
    size: float = 0.005,
    friction: str = "polynomial",
    home: ArrayLike | None = None,
    velocity_fraction: float | None = None,
    collision: bool = True,
    surroundings: Surroundings | None = None,
    seed: int = 0,
    progress: Progress = SILENT,
) -> Discrimination:
    """Finds the experiment that distinguishes two effects best, before any log exists.

    A reference motion within the robot's limits, the best of several, is followed by each kind of experiment. The kind
    that distinguishes the smallest effects is used. Kinds that need no manual change are preferred if they are sure,
    and the best of its variants (T-optimality: Atkinson and Fedorov 1975).

    Args:
        robot: the robot, its nominal dynamics known.
        rivals: two effects, such as ``stribeck:2,load_dependent_friction:2``. A joint left out is that of the other;
            left out of both, the one where the reference alone shows least.
        noise: standard deviation of the torque noise (n,) [N m or N]; by default 2 % of each joint's torque RMS.
        size: of what the effect shows beyond the base model, as a share of the joint's torque RMS in the reference.
        friction: of the base model, ``polynomial`` or ``coulomb-viscous``.
        home: pose (n,) at both ends of all motions; by default `Limits.home`.
        velocity_fraction: share of the velocity limits to use; by default see `LimitOptions`.
        collision: keep the motions free of collisions, which makes them smaller where they must be, and the home pose
            another one if it is not given and has no room.
        surroundings: the floor, and boxes that the arm must not enter.
        seed: of the reference motion.
        progress: receives the progress of each kind.

    Raises:
        InputError: an effect or joint that there is not, values out of range, dynamics that are not known.
        NotIdentifiableError: effects that no experiment of the catalogue separates.
        InfeasibleError: no motion keeps the limits.
    """
    places = parse_rivals(rivals, robot)
    level = _level(noise, robot)
    if not (np.isfinite(size) and 0.0 < size <= 1.0):
        raise InputError(f"found the size {size}", allowed="above 0, up to 1")
    velocity_fraction = velocity_share(robot, velocity_fraction)
    model = default_model(robot, friction=friction, velocity_scale=SHARP)
    planned = find_base_parameters(model)
    around = surroundings or Surroundings()
    if collision:
        kept = LimitOptions(velocity_fraction=velocity_fraction, torque=False, surroundings=around)
        safety = choose_safety(robot, planned, rest_pose(robot.limits, home), kept, movable=home is None)
        home = safety.home

    def build(seed: int, share: float) -> ExperimentBuilder:
        return ExperimentBuilder(planned, home=home, velocity_fraction=velocity_fraction, seed=seed, share=share)

    clear = ClearRuns(build, safety.collision if collision else None)
    builder, (reference, *_) = clear.reference(seed)
    base = planned.model
    if level is None:
        m, nominal = reference.motion, np.nan_to_num(base.nominal)
        level = SHARE * np.sqrt(np.mean(base.torque(m.q, m.dq, m.ddq, nominal) ** 2, axis=0))
    problem = _planned(reference, level, builder)
    pair = _choose(problem, places, reference)
    judge = Discriminator(problem, pair, size)
    best = judge("reference", (reference,))
    for draw in range(1, REFERENCES):
        other, alone = clear.reference(seed + draw)
        drawn = judge("reference", alone)
        if (not clear.problem(alone), drawn.merit) > (not clear.problem([reference]), best.merit):
            builder, reference, best = other, alone[0], drawn
    index = next((h.joint - 1 for h in pair if h.joint is not None), int(np.argmax(np.ptp(reference.motion.q, axis=0))))
    judged: dict[str, DiscriminationScore] = {}
    runs: dict[str, tuple[Run, ...]] = {}
    progress.start("kinds of experiment", len(MAKERS))
    try:
        for number, (kind, make) in enumerate(MAKERS.items(), start=1):
            try:
                runs[kind] = clear.runs(builder, kind, _maker(make, index, 0))
                judged[kind] = judge(kind, runs[kind])
            except InfeasibleError as error:
                judged[kind] = DiscriminationScore.impossible(kind, str(error))
            progress.update(number, kind)
    finally:
        progress.finish()
    if not runs:
        raise InfeasibleError(
            f"no kind of experiment is possible within the limits of {robot.name}: {judged['repeat'].note}"
        )
    require_separable(pair, list(judged.values()))
    kind = max(runs, key=lambda name: judged[name].merit)
    for variant in range(1, VARIANTS if kind in VARIED else 1):
        try:
            varied = clear.runs(builder, kind, _maker(MAKERS[kind], index, variant))
        except InfeasibleError:
            continue
        better = judge(kind, varied)
        if better.merit > judged[kind].merit:
            runs[kind], judged[kind] = varied, better
    return Discrimination(
        robot=robot,
        rivals=tuple((h.name, h.joint) for h in pair),
        kind=kind,
        what=EXPERIMENTS[kind],
        runs=runs[kind],
        ranking=tuple(sorted(judged.values(), key=lambda j: j.merit, reverse=True)),
        alone=best.resolves,
        noise=level,
        size=size,
        settings={
            "friction": friction,
            "home": builder.home.tolist(),
            "velocity_fraction": velocity_fraction,
            "seed": seed,
        },
        surroundings=around if collision else None,
    )


def _maker(
    make: Callable[[MotionRange, int, int], tuple[Stage, ...]], joint: int, variant: int
) -> Callable[[MotionRange], tuple[Stage, ...]]:
    """Gives what makes the stages of a kind of experiment within a range."""
    return lambda room: make(room, joint, variant)


def _level(noise: ArrayLike | None, robot: Robot) -> Array | None:
    if noise is None:
        return None
    level = np.asarray(noise, dtype=float)
    if level.shape != (robot.n,):
        raise InputError(f"torque noise of shape {level.shape}", allowed=f"{robot.n} numbers, one per joint")
    wrong = ~(np.isfinite(level) & (level > 0.0))
    if wrong.any():
        joint = int(np.argmax(wrong))
        raise InputError(f"a torque noise of {level[joint]:g}", joint=joint + 1, allowed="above 0")
    return level


def _planned(reference: Run, level: Array, builder: ExperimentBuilder) -> Problem:
    """Poses the diagnosis of the reference motion at `STEP`, the white part of the noise averaged over each step."""
    part = reference.parts(STEP)[0]
    sensors = Sensors()
    every = max(round(STEP / builder.period), 1)
    share = sensors.coloured_share
    kept = (1.0 - share) / every + share
    thinned = Sensors(coloured_share=share / kept, correlation_time=sensors.correlation_time)
    model = builder.base.model
    return planned_problem(
        model,
        np.asarray(model.nominal),
        [part.motion],
        noise=thinned,
        level=level * np.sqrt(kept),
    )


def _choose(problem: Problem, places: list[tuple[str, int | None]], reference: Run) -> tuple[Hypothesis, Hypothesis]:
    """Chooses the joint of rivals without one: where both act and the reference alone distinguishes them least."""
    robot = problem.situation.robot
    joints = [EFFECTS[name].joints(robot) if joint is None else (joint,) for name, joint in places]
    common = [joint for joint in joints[0] if joint in joints[1]]
    if common:
        options = [(joint, joint) for joint in common]
    else:
        options = [(first, second) for first in joints[0] for second in joints[1]]
    if not options:
        silent = places[0][0] if not joints[0] else places[1][0]
        raise InputError(f"{silent} cannot act on any joint of {robot.name}", remedy="choose another effect")
    best: tuple[float, tuple[Hypothesis, Hypothesis]] | None = None
    failed: NotIdentifiableError | None = None
    for first, second in options:
        pair = (Hypothesis(EFFECTS[places[0][0]], first), Hypothesis(EFFECTS[places[1][0]], second))
        if len(options) == 1:
            return pair
        try:
            merit = Discriminator(problem, pair, SHARE)("reference", (reference,)).energy
        except NotIdentifiableError as error:
            failed = error
            continue
        if best is None or merit < best[0]:
            best = merit, pair
    if best is None:
        assert failed is not None
        raise failed
    return best[1]
