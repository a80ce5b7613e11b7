"""Design of an experiment that distinguishes two possible causes, before any log exists.

Of each kind of experiment, T-optimality asks how much of either cause base model and rival would leave in the noise
(Atkinson and Fedorov 1975): here of the very motion that is written, the reference included.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from estimation.diagnosis.experiment_plans.experiment_motions import MAKERS, VARIED
from estimation.diagnosis.experiment_plans.next_experiment import VARIANTS
from estimation.diagnosis.experiment_plans.planned_limits import planned_problem
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from oed.campaigns.discrimination_options import DiscriminationOptions
from oed.campaigns.discriminations.clear_runs import ClearRuns
from oed.campaigns.discriminations.discrimination import Discrimination, DiscriminationScore
from oed.campaigns.discriminations.motions import ExperimentBuilder, Run
from oed.campaigns.discriminations.probabilities import EVALUATION_STEP, Discriminator, require_separable
from oed.experiments.assembly import rest_pose
from oed.experiments.checks import velocity_share
from oed.experiments.options import LimitOptions
from oed.experiments.safety_checks.safety import choose_safety
from robots.base_parameters import find_base_parameters
from robots.common.arrays import Array
from robots.common.errors import InfeasibleError, InputError, NotIdentifiableError
from robots.common.progress import SILENT, Progress
from robots.geometry.urdf_selection import nearest
from robots.plants import Sensors
from robots.regressor import default_model
from robots.robot import Robot
from robots.terms.effects import EFFECTS, EXPERIMENTS

NOISE_SHARE = 0.02
"""Noise as a share of each joint's torque RMS, where it is not stated."""


def discriminate(
    robot: Robot,
    rivals: str | Sequence[str],
    *,
    options: DiscriminationOptions | None = None,
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
        options: what is planned with.
        progress: receives the progress of each kind.

    Raises:
        InputError: an effect or joint that there is not, values out of range, dynamics that are not known.
        NotIdentifiableError: effects that no experiment of the catalogue separates.
        InfeasibleError: no motion keeps the limits.
    """
    places = parse_rivals(rivals, robot)
    how = options or DiscriminationOptions()
    level, size, home, seed = _level(how.noise, robot), how.size, how.home, how.seed
    velocity_fraction, friction = velocity_share(robot, how.velocity_fraction), how.friction
    # Velocity [rad/s or m/s] at which the planned model's friction turns round.
    planned = find_base_parameters(default_model(robot, friction=friction, velocity_scale=1e-3))
    if how.collision:
        kept = LimitOptions(velocity_fraction=velocity_fraction, torque=False, surroundings=how.surroundings)
        safety = choose_safety(robot, planned, rest_pose(robot.limits, home), kept, movable=home is None)
        home = safety.home

    def build(seed: int, share: float) -> ExperimentBuilder:
        return ExperimentBuilder(planned, home=home, velocity_fraction=velocity_fraction, seed=seed, share=share)

    clear = ClearRuns(build, safety.collision if how.collision else None)
    builder, (reference, *_) = clear.reference(seed)
    base = planned.model
    if level is None:
        m, nominal = reference.motion, np.nan_to_num(base.nominal)
        level = NOISE_SHARE * np.sqrt(np.mean(base.torque(m.q, m.dq, m.ddq, nominal) ** 2, axis=0))
    problem = _planned(reference, level, builder)
    pair = _choose(problem, places, reference)
    judge = Discriminator(problem, pair, size)
    best = judge("reference", (reference,))
    # Largest number of random reference motions; the most informative one is used.
    for draw in range(1, 6):
        other, alone = clear.reference(seed + draw)
        drawn = judge("reference", alone)
        if (not clear.problem(alone), drawn.merit) > (not clear.problem([reference]), best.merit):
            builder, reference, best = other, alone[0], drawn
    index = next((h.joint - 1 for h in pair if h.joint is not None), int(np.argmax(np.ptp(reference.motion.q, axis=0))))
    judged: dict[str, DiscriminationScore] = {}
    runs: dict[str, tuple[Run, ...]] = {}
    progress.start("kinds of experiment", len(MAKERS))
    try:
        for number, kind in enumerate(MAKERS, start=1):
            try:
                runs[kind] = clear.runs(builder, kind, index, 0)
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
            varied = clear.runs(builder, kind, index, variant)
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
        surroundings=how.surroundings if how.collision else None,
    )


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
    """Poses the diagnosis of the reference motion at `EVALUATION_STEP`, white noise averaged over each step."""
    part = reference.parts(EVALUATION_STEP)[0]
    sensors = Sensors()
    every = max(round(EVALUATION_STEP / builder.period), 1)
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
            merit = Discriminator(problem, pair, NOISE_SHARE)("reference", (reference,)).energy
        except NotIdentifiableError as error:
            failed = error
            continue
        if best is None or merit < best[0]:
            best = merit, pair
    if best is None:
        assert failed is not None
        raise failed
    return best[1]


def parse_rivals(rivals: str | Sequence[str], robot: Robot) -> list[tuple[str, int | None]]:
    """Reads two effects, each with a joint or without: ``stribeck:2,load_dependent_friction``.

    Raises:
        InputError: not two, an effect that the catalogue lacks, a joint where it cannot act, or one effect twice.
    """
    texts = [part.strip() for part in (rivals.split(",") if isinstance(rivals, str) else rivals)]
    if len(texts) != 2 or not all(texts):
        raise InputError(
            f"--discriminate needs two effects, found {len([t for t in texts if t])}",
            allowed="such as stribeck:2,backlash:2",
        )
    places = [_place(text, robot) for text in texts]
    if places[0][1] is None or places[1][1] is None:
        known = next((joint for _, joint in places if joint is not None), None)
        places = [
            (name, known if joint is None and known in EFFECTS[name].joints(robot) else joint) for name, joint in places
        ]
    if places[0] == places[1]:
        raise InputError(
            f"{texts[0]} and {texts[1]} are the same effect on the same joint",
            allowed="two different effects, or two different joints",
        )
    return places


def _place(text: str, robot: Robot) -> tuple[str, int | None]:
    name, colon, place = (part.strip() for part in text.partition(":"))
    effect = EFFECTS.get(name)
    if effect is None:
        close = nearest(name, EFFECTS)
        raise InputError(f"there is no effect {name!r}", allowed=", ".join(EFFECTS), remedy=close)
    if not colon:
        return name, None
    joints = effect.joints(robot)
    if effect.whole_robot:
        raise InputError(f"{name} acts on the whole robot, not on joint {place} alone", remedy=f"write {name}")
    if not re.fullmatch(r"[0-9]+", place) or int(place) not in joints:
        raise InputError(
            f"{name} cannot act on this joint of {robot.name}",
            joint=place or "(none)",
            allowed=", ".join(str(joint) for joint in joints) or "no joint of this robot",
        )
    return name, int(place)
