"""The verb: plans a campaign of excitation, friction and warm-up stages."""

from __future__ import annotations

import os
from concurrent.futures import Executor
from dataclasses import replace

import numpy as np

from oed.campaigns.checking import TorqueCheck, checked
from oed.campaigns.clearances import CollisionFreeRanges
from oed.campaigns.excitation import excitation_stage
from oed.campaigns.notes import campaign_notes
from oed.campaigns.planning import Planner
from oed.campaigns.programme import Programme
from oed.campaigns.result import Campaign
from oed.campaigns.shortening import fit_stages
from oed.campaigns.stages import Stage
from oed.campaigns.timetable import make_timetable
from oed.experiments import Design, LimitOptions, SearchOptions, usable_limits
from oed.experiments import design as design_experiment
from oed.experiments.checks import velocity_share
from oed.experiments.safety_checks.freedom import freedom_of
from oed.trajectories import PiecewisePolynomial
from robots.collision import Surroundings
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.parallel import one_blas_thread
from robots.common.progress import SILENT, Progress
from robots.robot import Robot
from robots.thermal import KnownThermal, known_thermal


@one_blas_thread()
def campaign(
    robot: Robot,
    *,
    programme: Programme | None = None,
    design: Design | str | os.PathLike[str] | None = None,
    velocity_fraction: float = 1.0,
    torque_margin: float = 0.1,
    collision: bool = True,
    surroundings: Surroundings | None = None,
    ambient: float = 20.0,
    cold_friction: float = 1.0,
    thermal: KnownThermal | None = None,
    seed: int = 0,
    workers: int | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Campaign:
    """Plans a campaign that warms the robot up and measures its parameters and friction meanwhile.

    A heating cycle has three stages (thesis sections 2.4 and 5.1): an excitation, a friction stage and a warm-up. The
    friction stage moves each joint at constant speeds in both directions, if possible in a pose in which gravity does
    no work on it. The warm-up moves all joints at full speed over 80 % of their ranges. Jerk-limited moves join them.
    Every stage starts and ends at rest in the home pose, so stages can be played in any order. If they do not fit into
    the cycle, the friction stage is shortened first, then the warm-up; the notes say so.

    Args:
        robot: the robot.
        programme: what to run how often; 24 cycles of 5 min by default.
        design: the excitation, or its folder; a quick one is designed by default. Its first pose is home.
        velocity_fraction: share of the velocity limits to use.
        torque_margin: share of the torque limits kept as reserve for errors of the nominal dynamics.
        collision: keep the stages free of collisions, if the robot's bodies are described. The quick excitation avoids
            them, warm-up and friction stages use only the free part of the ranges, and moves go around obstacles.
        surroundings: the floor, and boxes that the arm must not enter.
        ambient: ambient temperature [degC].
        cold_friction: friction of the cold robot over that of the description, for the expected temperatures: above 1
            where the description is of the warm robot.
        thermal: models of the joints; by default the published ones, if there are any.
        seed: of the quick design.
        workers: processes of the quick design.
        executor: runs the quick design's searches.
        progress: receives the progress.

    Returns:
        The campaign; all its stages keep all limits by their own samples.

    Raises:
        InputError: options out of range, a design for another robot.
        InfeasibleError: a limit of zero, stages that exceed a limit, or a cycle that is too short.
    """
    plan = programme or Programme()
    for name, value, allowed, good in (
        ("ambient", ambient, "a temperature in degC", bool(np.isfinite(ambient))),
        ("cold_friction", cold_friction, "a positive number", 0.0 < cold_friction < np.inf),
    ):
        if not good:
            raise InputError(f"{name} is {value}", allowed=allowed)
    velocity_share(robot, velocity_fraction)  # refuses one that is out of range
    limits = usable_limits(robot.limits, velocity_fraction)
    torque = TorqueCheck(robot, torque_margin)
    listener = progress or SILENT
    notes: list[str] = []
    excitation, home = None, limits.home
    around = surroundings or Surroundings()
    bodies = around.model(robot)
    if plan.cycles:
        made: Design | str | os.PathLike[str]
        if design is not None:
            made = design
        else:
            made = design_experiment(
                robot,
                limits=LimitOptions(
                    velocity_fraction=velocity_fraction,
                    torque_margin=torque_margin,
                    collision=collision,
                    surroundings=around,
                ),
                search=SearchOptions(effort="quick", seed=seed, workers=workers, executor=executor),
                progress=progress,
            )
            notes.append("The excitation comes from a quick search. For a better one, run oed design and use --design.")
        excitation, remarks = excitation_stage(robot, made)
        notes += remarks
        home = excitation.motion.q[0]
        excitation = checked(excitation, robot, home, torque)
    listener.start(f"planning a campaign for {robot.name}", None)
    try:
        free_ranges = CollisionFreeRanges(bodies, home) if collision else None
        if free_ranges is not None and not free_ranges.possible:
            if bodies.pairs:
                notes.append(
                    "The home pose collides in the collision model, so collisions of the stages could not be avoided."
                )
            free_ranges = None
        planner = Planner(robot=robot, limits=limits, home=home, torque=torque, free_ranges=free_ranges)
        stages = [_power_on_stage(plan, home, robot.period)] if plan.power_on else []
        if excitation is not None:
            stages.append(excitation)
        if plan.cycles or plan.cooling:
            fitted, remarks = fit_stages(planner, plan, excitation)
            stages += fitted
            notes += remarks
        stages = [checked(stage, robot, home, torque) for stage in stages]
        stages = [replace(stage, freedom=freedom_of(bodies, stage.motion)) for stage in stages]
        slots = make_timetable(plan, {stage.name: len(stage.motion) for stage in stages}, robot.period)
        known = thermal or known_thermal(robot, ambient=ambient)
        if known is not None and len(known.models) != robot.n:
            raise InputError(f"{len(known.models)} thermal models", allowed=f"{robot.n}, one per joint")
        if known is not None:
            known = replace(known, models=tuple(replace(model, ambient=ambient) for model in known.models))
        notes += campaign_notes(stages, planner, known)
    finally:
        listener.finish()
    return Campaign(
        robot=robot,
        programme=plan,
        home=home,
        stages=tuple(stages),
        slots=slots,
        thermal=known,
        ambient=ambient,
        cold_friction=cold_friction,
        torque_margin=torque_margin,
        notes=tuple(notes),
        settings={
            "velocity_fraction": velocity_fraction,
            "collision": collision,
            **around.settings(),
            "seed": seed,
            "design": os.path.abspath(design) if isinstance(design, str | os.PathLike) else None,
        },
    )


def _power_on_stage(plan: Programme, home: Array, period: float) -> Stage:
    """Holds home with the motors on; a long test repeats a file of one cycle or less."""
    blocks = int(np.ceil(plan.power_on / plan.cycle_time - 1e-9))
    samples = max(2, round(plan.power_on / blocks / period))
    end = (samples - 1) * period
    return Stage(
        name="power_on",
        kind="power_on",
        motion=PiecewisePolynomial.hold(home, end).motion(period),
        segments=({"kind": "power_on", "start": 0.0, "end": end, "joint": None},),
    )
