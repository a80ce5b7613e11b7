"""The verb: designs an optimal excitation experiment."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from oed.criteria import Criterion
from oed.criteria import criterion as choose_criterion
from oed.experiments.assembly import assemble, rest_pose
from oed.experiments.checks import check_period, usable_limits, velocity_share
from oed.experiments.options import LimitOptions, ModelOptions, SearchOptions, TrajectoryOptions, WeightOptions
from oed.experiments.problems.criterion_weighting import choose_weighting
from oed.experiments.problems.essential import essential_part
from oed.experiments.problems.problem import FourierProblem
from oed.experiments.quality import measure
from oed.experiments.results.outcome import Outcome
from oed.experiments.results.result import Design
from oed.experiments.safety_checks.freedom import collision_data
from oed.experiments.safety_checks.margins import measured_margins
from oed.experiments.safety_checks.safety import Safety, choose_safety
from oed.experiments.safety_checks.spatial_check import SpatialMargin, motion_margins
from oed.experiments.searches.islands import search_islands
from oed.experiments.searches.search import Found
from oed.trajectories import count_periods
from robots.base_parameters import BaseParameters, find_base_parameters
from robots.common.arrays import Array
from robots.common.errors import InfeasibleError
from robots.common.parallel import one_blas_thread
from robots.common.progress import SILENT, Progress
from robots.limits import Limits
from robots.loading import load_robot
from robots.regressor import default_model
from robots.robot import Robot
from robots.signals import Motion
from robots.terms.situations.flange_body import carrying, payload_part


@one_blas_thread()
def design(
    robot: Robot | str | Path,
    *,
    criterion: str | Criterion = "cond",
    model: ModelOptions | None = None,
    trajectory: TrajectoryOptions | None = None,
    limits: LimitOptions | None = None,
    weights: WeightOptions | None = None,
    search: SearchOptions | None = None,
    progress: Progress | None = None,
) -> Design:
    """Designs an excitation experiment that is optimal for the model which will be fitted.

    The optimised part, by default a finite Fourier series per joint, is at rest at both ends (thesis eq. 78 to 80). It
    minimises the criterion of the base regressor under the limits of position, velocity, acceleration and jerk, by an
    interior-point method with exact derivatives from screened starts and hops. One stroke per joint to its velocity
    bound (eq. 81 to 83) and jerk-limited moves complete it.

    Args:
        robot: the robot, or what `load_robot` takes: a catalogue name, a URDF, a robot YAML.
        criterion: ``cond``, ``d``, ``a``, ``e``, ``cond-d``, or a criterion of one's own.
        model: which model will be fitted: friction, rotor inertia, offsets.
        trajectory: the family of the optimised part, repetitions, strokes, home pose.
        limits: which limits the experiment keeps besides the joints': torque, collisions, space.
        weights: how rows and columns count, and what an earlier identification knows.
        search: effort, seed, solver, processes.
        progress: hears how far it is.

    Returns:
        The design, checked by its own samples.

    Raises:
        InputError: options out of range, an unknown criterion.
        InfeasibleError: a limit of zero, or no start that keeps the limits and excites all parameters.
    """
    described = robot if isinstance(robot, Robot) else load_robot(robot)
    chosen = choose_criterion(criterion)
    fitted, plan = model or ModelOptions(), trajectory or TrajectoryOptions()
    kept, weighed, work = limits or LimitOptions(), weights or WeightOptions(), search or SearchOptions()
    known = carrying(described, kept.payload)
    settings: dict[str, Any] = {}
    for group in (fitted, plan, kept, weighed, work):
        settings |= group.settings()
    family = plan.excitation
    count_periods(family.duration, known.period)
    share = velocity_share(known, kept.velocity_fraction)
    bounds = usable_limits(known.limits, share)
    settings["velocity_fraction"] = share
    check_period(bounds, family.duration)
    base = _base(known, fitted, bounds, plan, chosen)
    samples = plan.periods * family.duration / known.period
    weighting = choose_weighting(base, chosen, weighed.scaling, weighed.noise, weighed.after, weighed.task, samples)
    safety = choose_safety(known, base, rest_pose(bounds, plan.home), kept, movable=plan.home is None)
    waves = (family.size + 1) // 2
    # Per period and per wave of it: 20 samples of the regressor, and 50 of the limits.
    problem = FourierProblem(
        base=base,
        criterion=chosen,
        limits=bounds,
        family=family,
        samples=max(FourierProblem.samples, 20 * waves),
        limit_samples=max(FourierProblem.limit_samples, 50 * waves),
        pointwise=safety.pointwise,
        averaged=safety.averaged,
        home=safety.home,
        weighting=weighting,
    )
    # Home pose and limits are checked first, so that errors appear before the long search.
    assemble(
        problem.series(np.zeros(problem.size)),
        bounds,
        period=known.period,
        home=safety.home,
        kind=family.kind,
        strokes=plan.strokes,
    )
    problem.cost(np.zeros(problem.size))  # compiles, once for all processes
    results = search_islands(
        problem,
        work.counts,
        work.solver,
        seed=work.seed,
        time_limit=work.time_limit,
        keep_on_interrupt=work.keep_on_interrupt,
        workers=work.workers,
        executor=work.executor,
        progress=progress or SILENT,
    )
    best = min(results, key=lambda found: found.cost)
    if not np.isfinite(best.cost):
        raise InfeasibleError(
            "no motion found that excites all parameters", remedy="allow more motion, or fit fewer parameters"
        )
    return _assembled(problem, best.z, safety, plan, kept, tuple(_outcome(found) for found in results), settings)


def _base(
    robot: Robot, fitted: ModelOptions, limits: Limits, plan: TrajectoryOptions, criterion: Criterion
) -> BaseParameters:
    """The parameters that will be fitted; only the essential ones where that is asked for."""
    model = default_model(
        robot,
        friction=fitted.friction,
        velocity_scale=fitted.velocity_scale,
        rotor=fitted.rotor,
        offset=fitted.offset,
    )
    if fitted.payload_only:
        return payload_part(model)
    base = find_base_parameters(model)
    if not fitted.essential:
        return base
    free = FourierProblem(base=base, criterion=criterion, limits=limits, family=plan.excitation)
    return essential_part(free, fitted.essential)


def _assembled(
    problem: FourierProblem,
    z: Array,
    safety: Safety,
    plan: TrajectoryOptions,
    kept: LimitOptions,
    outcomes: tuple[Outcome, ...],
    settings: dict[str, Any],
) -> Design:
    """The whole experiment around the best optimised part, measured."""
    base, family, robot = problem.base, problem.family, problem.base.model.robot
    sequence, report, left_out, safety = safety.assembled(
        problem.series(z, plan.periods), family.kind, problem.limits, robot.period, plan.strokes
    )
    motion = sequence.motion()
    design = Design(
        robot=robot,
        base=base,
        criterion=problem.criterion,
        motion=motion,
        segments=tuple(sequence.table()),
        qualities=(),
        margins=measured_margins(robot, motion, base, kept.static_effects),
        islands=outcomes,
        settings=settings,
        coefficients=family.coefficients(problem.free(z)),
        home=safety.home,
        home_moved=safety.moved,
        space=_space(safety, motion),
        freedom=None if report is None or safety.collision is None else collision_data(safety.collision, report),
        strokes_left_out=left_out,
    )
    parts = [family.kind, *(["sinusoid"] if any(s["kind"] == "sinusoid" for s in design.segments) else [])]
    qualities = [*(measure(part, base, design.part(part)) for part in parts), measure("whole", base, motion)]
    weighting = problem.weighting
    if not weighting.plain:
        label = f"{family.kind} ({weighting.name})"
        qualities.insert(1, measure(label, base, design.part(family.kind), weighting))
    return replace(design, qualities=tuple(qualities))


def _space(safety: Safety, motion: Motion) -> tuple[SpatialMargin, ...]:
    own = () if safety.motion is None else motion_margins(safety.motion, motion)
    return (*(() if safety.check is None else safety.check.margins(motion)), *own)


def _outcome(found: Found) -> Outcome:
    return Outcome(
        island=found.number + 1,
        initial=found.initial,
        final=found.value,
        iterations=found.iterations,
        evaluations=found.evaluations,
        status=found.status,
        starts=found.starts,
    )
