"""The local solvers of designs, with the same starts, hops and exact gradients: quality over processor time.

Run it with ``python benchmarks/solvers.py [--arms er3a ur10 panda] [--solvers interior-point slsqp ipopt]
[--seeds 4] [--budget 40] [--kinematic]``. All arms keep all limits: position, velocity, acceleration, torque where it
is described, and the clearance of the arm to itself (``--kinematic``: none of the last two). Every solver gets the
search of ``oed design``: screened starts, hops, stand-ins of the criterion with exact gradients. SLSQP of scipy and
IPOPT see a working set of limit rows, and what they find is pulled within all limits.

The best condition number so far is noted after each local solution, on a grid that no solver optimised on. Each search
has one process and one thread, one runs after the other, and seconds are the processor's, without the compilation that
all share. The table has the mean over the seeds and its 95 % interval (Student's t).
"""

from __future__ import annotations

import argparse
import platform
import sys
import time
import warnings
from contextlib import suppress
from dataclasses import replace

import numpy as np
import scipy
from scipy.stats import t as student
from threadpoolctl import threadpool_limits

from oed.criteria import criterion
from oed.experiments import EFFORTS, InteriorPoint, Ipopt, Slsqp, Solver, usable_limits
from oed.experiments.assembly import rest_pose
from oed.experiments.options import LimitOptions
from oed.experiments.problems.problem import FourierProblem
from oed.experiments.safety_checks.safety import choose_safety
from oed.experiments.searches.search import Island
from robots.base_parameters import find_base_parameters
from robots.common.errors import AssumedValueWarning
from robots.common.parallel import one_blas_thread
from robots.loading import load_robot
from robots.regressor import default_model

MOMENTS = (2, 5, 10, 20, 40)
SOLVERS: dict[str, Solver] = {solver.name: solver for solver in (InteriorPoint(), Slsqp(), Ipopt())}


class OverError(Exception):
    """The time is over."""


def problem_of(name: str, *, all_limits: bool) -> FourierProblem:
    """The Fourier part of an arm's design with Coulomb and viscous friction, as ``oed design`` states it."""
    robot = load_robot(name)
    base = find_base_parameters(default_model(robot, friction="coulomb-viscous", velocity_scale=0.02, offset=False))
    limits = usable_limits(robot.limits)
    problem = FourierProblem(base=base, criterion=criterion("cond"), limits=limits)
    if not all_limits:
        return problem
    pose = rest_pose(limits, None)
    kept = LimitOptions(torque=True, torque_margin=0.1, collision=True, clearance=0.01)
    safety = choose_safety(robot, base, pose, kept, movable=True)
    return replace(problem, pointwise=safety.pointwise, averaged=safety.averaged, home=safety.home)


def searched(problem: FourierProblem, solver: Solver, seed: int, budget: float) -> list[float]:
    """Searches until the time is over; the best value at each moment within it, infinite before the first."""
    trace: list[tuple[float, float]] = []

    def tell(_: int, best: float) -> None:
        trace.append((time.process_time() - start, best))
        if trace[-1][0] > budget:
            raise OverError

    island = Island(problem, replace(EFFORTS["thorough"], hops=100_000), solver, seed, 0, tell=tell)
    start = time.process_time()
    with suppress(OverError), threadpool_limits(limits=1):
        island.search()
    moments = [moment for moment in MOMENTS if moment <= budget]
    return [min((value for when, value in trace if when <= moment), default=np.inf) for moment in moments]


def interval(values: np.ndarray) -> str:
    """Mean and 95 % interval; "none" where a seed has no design yet."""
    if not np.isfinite(values).all():
        return "none yet"
    half = (
        student.ppf(0.975, len(values) - 1) * values.std(ddof=1) / np.sqrt(len(values)) if len(values) > 1 else np.nan
    )
    return f"{values.mean():.1f} ± {half:.1f}"


@one_blas_thread()
def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--arms", nargs="+", default=["er3a", "ur10", "panda"])
    parser.add_argument("--solvers", nargs="+", default=list(SOLVERS), choices=list(SOLVERS))
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--budget", type=float, default=float(MOMENTS[-1]), help="processor seconds of each search")
    parser.add_argument("--kinematic", action="store_true", help="without limits of torque and in space")
    options = parser.parse_args()
    warnings.simplefilter("ignore", AssumedValueWarning)
    print(f"Python {platform.python_version()}, scipy {scipy.__version__}; one thread", file=sys.stderr)
    moments = [moment for moment in MOMENTS if moment <= options.budget]
    print("| arm | solver |" + "".join(f" {moment} s |" for moment in moments))
    print("|---|---|" + "---|" * len(moments))
    for arm in options.arms:
        problem = problem_of(arm, all_limits=not options.kinematic)
        searched(problem, SOLVERS[options.solvers[0]], 0, 0.0)  # compiles
        found: dict[str, list[list[float]]] = {name: [] for name in options.solvers}
        for seed in range(options.seeds):
            for name in options.solvers:
                found[name].append(searched(problem, SOLVERS[name], seed, options.budget))
                print(arm, name, seed, np.round(found[name][-1], 2), file=sys.stderr, flush=True)
        for name, rows in found.items():
            print(f"| {arm} | {name} |" + "".join(f" {interval(column)} |" for column in np.array(rows).T), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
