"""How the cost of one criterion with its gradient grows with samples and with joints.

Run it with ``python benchmarks/scaling.py``. Prints the time of one evaluation against the number of samples, the
exponent of its growth (1 is linear), and the 7-joint panda over the 6-joint er3a and ur10: for one evaluation and for
one iteration of the solver. Times are the processor's, the least of several rounds, one thread; without compilation.
"""

from __future__ import annotations

import sys
import time
import warnings
from dataclasses import replace

import numpy as np

from oed.criteria import criterion
from oed.experiments import InteriorPoint, usable_limits
from oed.experiments.problems.problem import FourierProblem
from oed.experiments.solvers import Stage
from robots.base_parameters import find_base_parameters
from robots.common.errors import AssumedValueWarning
from robots.common.parallel import one_blas_thread
from robots.loading import load_robot
from robots.regressor import default_model

SAMPLES = (104, 208, 416, 832, 1664, 3328)
ROUNDS, CALLS, ITERATIONS = 7, 10, 40


def problem_of(name: str) -> FourierProblem:
    robot = load_robot(name)
    base = find_base_parameters(default_model(robot, friction="coulomb-viscous", velocity_scale=0.02, offset=False))
    return FourierProblem(base=base, criterion=criterion("cond"), limits=usable_limits(robot.limits))


def evaluation(problem: FourierProblem) -> float:
    """Seconds of one criterion with its gradient."""
    z = problem.shrunk(np.random.default_rng(0).normal(size=problem.size), 0.9)
    problem.surrogate(z, 16)
    best = np.inf
    for _ in range(ROUNDS):
        start = time.process_time()
        for _ in range(CALLS):
            problem.surrogate(z, 16)
        best = min(best, (time.process_time() - start) / CALLS)
    return best


def iteration(problem: FourierProblem) -> float:
    """Seconds of one iteration of the solver."""
    z = problem.shrunk(np.random.default_rng(0).normal(size=problem.size), 0.9)
    stage = Stage(sharpness=16, max_iter=ITERATIONS, barrier=1e-4)
    best = np.inf
    for _ in range(3):
        start = time.process_time()
        solved = InteriorPoint().minimise(problem, z, [stage])
        best = min(best, (time.process_time() - start) / max(solved.iterations, 1))
    return best


@one_blas_thread()
def main() -> int:
    warnings.simplefilter("ignore", AssumedValueWarning)
    problems = {name: problem_of(name) for name in ("er3a", "ur10", "panda")}
    er3a = problems["er3a"]
    times = [evaluation(replace(er3a, samples=samples)) for samples in SAMPLES]
    print("er3a, 52 columns: one criterion with its gradient")
    for samples, seconds in zip(SAMPLES, times, strict=True):
        print(f"  {samples:5} samples {1e3 * seconds:8.2f} ms {1e6 * seconds / samples:8.2f} us a sample")
    growth = float(np.polyfit(np.log(SAMPLES), np.log(times), 1)[0])
    more, dearer = SAMPLES[-1] // SAMPLES[0], times[-1] / times[0]
    print(f"  grows as samples^{growth:.2f}; {more} times the samples cost {dearer:.1f} times as much")
    for what, measure in (("evaluation", evaluation), ("iteration", iteration)):
        cost = {name: measure(problem) for name, problem in problems.items()}
        sizes = ", ".join(f"{n} {1e3 * c:.2f} ms" for n, c in cost.items())
        ratios = " and ".join(f"{cost['panda'] / cost[name]:.2f} times the {name}" for name in ("er3a", "ur10"))
        print(f"one {what}: {sizes}; 7 joints cost {ratios}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
