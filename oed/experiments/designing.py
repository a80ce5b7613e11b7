"""The verb: designs an optimal excitation experiment."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import asdict, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from oed.constraints.geometric import GeometricLimit
from oed.criteria import Criterion, Prior
from oed.criteria import criterion as choose_criterion
from oed.experiments.assembly import assemble, rest_pose
from oed.experiments.checks import check_options, check_period, usable_limits
from oed.experiments.problems.criterion_weighting import choose_weighting
from oed.experiments.problems.essential import essential_part
from oed.experiments.problems.problem import FourierProblem
from oed.experiments.quality import design_model, measure
from oed.experiments.results.outcome import Outcome
from oed.experiments.results.result import Design
from oed.experiments.safety_checks.margins import measured_margins
from oed.experiments.safety_checks.safety import choose_safety, collision_data
from oed.experiments.searches.islands import search_islands
from oed.experiments.searches.search import EFFORTS, Effort, Found
from oed.experiments.solvers import InteriorPoint, Solver
from oed.trajectories import FourierSeries, count_periods
from robots.base_parameters import find_base_parameters
from robots.common.errors import InfeasibleError, InputError
from robots.common.parallel import one_blas_thread
from robots.common.plain import finite
from robots.common.progress import SILENT, Progress
from robots.plants import PlantEffect
from robots.robot import Robot
from robots.signals import Motion

Array = NDArray[np.float64]


@one_blas_thread()
def design(
    robot: Robot,
    *,
    criterion: str | Criterion = "cond",
    friction: str = "polynomial",
    offset: bool = False,
    rotor: bool = True,
    essential: float = 0.0,
    velocity_scale: float = 0.02,
    harmonics: int = 5,
    base_frequency: float = 0.1,
    periods: int = 3,
    strokes: bool = True,
    home: ArrayLike | None = None,
    velocity_fraction: float = 1.0,
    torque: bool = True,
    torque_margin: float = 0.1,
    collision: bool = False,
    clearance: float = 0.01,
    space: Sequence[GeometricLimit] = (),
    scaling: str = "none",
    noise: ArrayLike | None = None,
    after: Prior | None = None,
    effects: Sequence[PlantEffect] = (),
    task: Motion | None = None,
    effort: str | Effort = "standard",
    time_limit: float = np.inf,
    keep_on_interrupt: bool = False,
    seed: int = 0,
    solver: Solver | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Design:
    """Designs an excitation experiment that is optimal for the model which will be fitted.

    A finite Fourier series per joint, at rest at both ends (thesis eq. 78 to 80), minimises the criterion of the base
    regressor under the limits of position, velocity, acceleration and jerk, by an interior-point method with exact
    derivatives from screened starts and hops. One stroke per joint to its velocity bound (eq. 81 to 83) and
    jerk-limited moves complete it.

    Args:
        robot: the robot.
        criterion: ``cond``, ``d``, ``a``, ``e``, ``cond-d``, or a criterion of one's own.
        friction: ``polynomial`` or ``coulomb-viscous``, as it will be fitted.
        offset: with torque offset columns.
        rotor: with rotor inertia columns.
        essential: leaves out base parameters whose torque, by the robot's description, stays below this share of each
            joint's on random motions; 0 keeps all.
        velocity_scale: of the Coulomb column tanh(dq / scale) [rad/s].
        harmonics: of the series.
        base_frequency: of the first harmonic [Hz].
        periods: how often the series is repeated.
        strokes: with the strokes to the velocity bounds.
        home: pose (n,) at both ends [rad or m]; by default zero, or the nearest pose free of collisions.
        velocity_fraction: of the velocity limits that may be used.
        torque: keep the torque limits by the robot's nominal dynamics, where both are described.
        torque_margin: share of the torque limits kept for what the nominal dynamics are wrong by.
        collision: keep the arm clear of itself and of the obstacles in the robot's file; the whole experiment is then
            proved free at all times.
        clearance: to keep [m].
        space: further limits in space, such as `ToolBox`, `PlaneLimit` and `SingularityLimit`.
        scaling: of the columns that the criterion judges: ``none``, ``nominal`` (each by the size its parameter has in
            the robot's description) or ``unit`` (each to unit length).
        noise: torque noise of each joint (n,) [N m or N]: rows count by one over it; all alike by default.
        after: what an earlier identification knows: the design adds what that lacks.
        effects: what the robot has beyond its description, as a diagnosis found it: the torque of those that follow
            from position, velocity and acceleration counts within the torque limits.
        task: with criterion ``i``, the motion whose torques are to be predicted.
        effort: ``quick``, ``standard``, ``thorough``, or counts of one's own.
        time_limit: for the search [s]; past it the best design so far is kept. Without it the same seed gives the same
            design on a fast and on a slow machine.
        keep_on_interrupt: on Ctrl-C during the search, end it and keep the best design so far; a second one ends all.
        seed: of everything random: the same seed gives the same design.
        solver: the local solver: `InteriorPoint` by default, or `Ipopt`.
        workers: processes; as many as cores by default.
        executor: runs the starts instead of processes of its own.
        progress: receives the progress.

    Returns:
        The design, checked by its own samples.

    Raises:
        InputError: options out of range, an unknown criterion.
        InfeasibleError: a limit of zero, or no start that keeps the limits and excites all parameters.
    """
    chosen = choose_criterion(criterion)
    check_options(harmonics, base_frequency, periods, velocity_fraction, time_limit, seed)
    work, local = _effort(effort), solver or InteriorPoint()
    count_periods(1 / base_frequency, robot.period)
    settings = {
        "friction": friction,
        "offset": offset,
        "rotor": rotor,
        "essential": essential,
        "velocity_scale": velocity_scale,
        "harmonics": harmonics,
        "base_frequency": base_frequency,
        "periods": periods,
        "strokes": strokes,
        "home": None if home is None else np.asarray(home, dtype=float).tolist(),
        "velocity_fraction": velocity_fraction,
        "torque_margin": torque_margin if torque else None,
        "collision": collision,
        "clearance": clearance if collision else None,
        "space": [repr(limit) for limit in space],
        "scaling": scaling,
        "noise": None if noise is None else np.asarray(noise, dtype=float).tolist(),
        "after": after is not None,
        "effects": [asdict(effect) for effect in effects],
        "seed": seed,
        "effort": asdict(work),
        "time_limit": finite(time_limit),
        "solver": {"name": local.name, **asdict(local)},
    }
    limits = usable_limits(robot.limits, velocity_fraction)
    check_period(limits, base_frequency)
    base = find_base_parameters(design_model(robot, settings))
    if essential:
        free = FourierProblem(
            base=base, criterion=chosen, limits=limits, harmonics=harmonics, base_frequency=base_frequency
        )
        base = essential_part(free, essential)
    weighting = choose_weighting(base, chosen, scaling, noise, after, task, periods / base_frequency / robot.period)
    pose = rest_pose(limits, home)
    safety = choose_safety(
        robot,
        base,
        pose,
        movable=home is None,
        torque=torque,
        torque_margin=torque_margin,
        collision=collision,
        clearance=clearance,
        space=space,
        effects=[effect for effect in effects if effect.static],
    )
    problem = FourierProblem(
        base=base,
        criterion=chosen,
        limits=limits,
        harmonics=harmonics,
        base_frequency=base_frequency,
        samples=max(FourierProblem.samples, 20 * harmonics),
        limit_samples=max(FourierProblem.limit_samples, 50 * harmonics),
        pointwise=safety.pointwise,
        averaged=safety.averaged,
        home=safety.home,
        weighting=weighting,
    )
    # Home pose and limits are checked first, so that errors appear before the long search.
    rest = FourierSeries.from_coefficients(np.zeros((robot.n, 2 * harmonics + 1)), base_frequency)
    rest = replace(rest, offsets=problem.centre)
    assemble(rest, limits, period=robot.period, home=safety.home, strokes=strokes)
    problem.cost(np.zeros(problem.size))  # compiles, once for all processes
    results = search_islands(
        problem,
        work,
        local,
        seed=seed,
        time_limit=time_limit,
        keep_on_interrupt=keep_on_interrupt,
        workers=workers,
        executor=executor,
        progress=progress or SILENT,
    )
    best = min(results, key=lambda found: found.cost)
    if not np.isfinite(best.cost):
        raise InfeasibleError(
            "no motion found that excites all parameters", remedy="allow more motion, or fit fewer parameters"
        )
    series = problem.series(best.z, periods)
    sequence, freedom, left_out = safety.assembled(series, limits, robot.period, strokes)
    motion = sequence.motion()
    design = Design(
        robot=robot,
        base=base,
        criterion=chosen,
        motion=motion,
        segments=tuple(sequence.table()),
        qualities=(),
        margins=measured_margins(robot, motion, base, [effect for effect in effects if effect.static]),
        islands=tuple(_outcome(found) for found in results),
        settings=settings,
        coefficients=series.coefficients,
        home=safety.home,
        home_moved=safety.moved,
        space=() if safety.check is None else safety.check.margins(motion),
        freedom=None if freedom is None else collision_data(freedom),
        strokes_left_out=left_out,
    )
    parts = ["fourier", *(["sinusoid"] if any(s["kind"] == "sinusoid" for s in design.segments) else [])]
    qualities = [*(measure(part, base, design.part(part)) for part in parts), measure("whole", base, motion)]
    if not weighting.plain:
        qualities.insert(1, measure(f"fourier ({weighting.name})", base, design.part("fourier"), weighting))
    return replace(design, qualities=tuple(qualities))


def _effort(choice: str | Effort) -> Effort:
    if isinstance(choice, Effort):
        return choice
    if choice not in EFFORTS:
        raise InputError(f"effort {choice!r}", allowed=", ".join(EFFORTS))
    return EFFORTS[choice]


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
