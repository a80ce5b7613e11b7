"""The design of an experiment: ours against evolution, a genetic algorithm and SLSQP with finite differences.

Run it with ``python benchmarks/design.py [--budget 600] [--columns 52 64] [--seeds 3] [--workers 2]``. All minimise the
same compiled condition number of the same robot under the same limits, and what they find is measured on a grid that
none of them optimised on. The rivals are what the literature uses (a genetic algorithm, then a gradient solver with
finite differences), and are treated well: every individual of an evolution is pulled within the limits instead of being
punished; SLSQP starts again as often as there is time, and its result is pulled within the limits, too. Once more it
runs with our screened starts and a working set of limit rows: what is left is due to exact derivatives, smooth
stand-ins and hops. SLSQP with exact gradients inside our own search is the strong rival: it differs by the local solver
alone, has the same seeds and seconds as ours, and is compared with it at equal times; ``benchmarks/solvers.py`` does
the same under limits of torque and in space. The genetic algorithm is pymoo's (``pip install .[benchmarks]``); without
it, its rows are missing.

Each candidate has one process and one thread. Times are the processor's, which on an idle machine are the clock's, so
that other work on the machine does not count. The compilation, which all share, is not in them. A ratio is the time at
which a rival reached its best value over the time that ours took to the same value, the median over our seeds.
"""

from __future__ import annotations

import argparse
import platform
import sys
import time
import warnings
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.optimize import LinearConstraint, differential_evolution, minimize

from oed.criteria import criterion
from oed.experiments import EFFORTS, InteriorPoint, Slsqp, Solver, usable_limits
from oed.experiments.problems.problem import FourierProblem
from oed.experiments.problems.working_set import WorkingSet
from oed.experiments.searches.search import Island
from robots.base_parameters import find_base_parameters
from robots.common.errors import AssumedValueWarning
from robots.common.parallel import available_cores, parallel_map
from robots.loading import load_robot
from robots.regressor import default_model

Array = NDArray[np.float64]
Trace = list[tuple[float, float]]

FRICTION = {52: "coulomb-viscous", 64: "polynomial"}
OURS, EVOLUTION, GENETIC = "ours", "differential evolution", "genetic algorithm (pymoo)"
SLSQP, HELPED = "SLSQP", "SLSQP, our starts and rows"
EXACT = "SLSQP, exact, our search"
MOMENTS = (5, 10, 20, 60, 120, 240, 600)
OUR_SECONDS = 30.0
FINE_SAMPLES = 1000
# Of the coefficients in units of what brings a joint to its limits; the best designs known stay below 1.
BOX = 1.5


class OverError(Exception):
    """The time is over."""


@dataclass
class Clock:
    """Seconds of this process, and the best value so far at each improvement."""

    budget: float
    trace: Trace = field(default_factory=list)
    start: float = field(default_factory=time.process_time)

    def note(self, value: float) -> None:
        """Notes an improvement."""
        if not self.trace or value < self.trace[-1][1]:
            self.trace.append((self.elapsed, value))

    def check(self) -> None:
        """Ends the search when the budget is used up."""
        if self.elapsed > self.budget:
            raise OverError

    @property
    def elapsed(self) -> float:
        """Processor seconds since the start."""
        return time.process_time() - self.start


@dataclass(frozen=True)
class Task:
    """One search: who, on how many columns, from which seed, for how long."""

    who: str
    columns: int
    seed: int
    budget: float


def problem_of(columns: int) -> FourierProblem:
    """The ER3A's Fourier part: 5 harmonics, 0.1 Hz, 36 base, 4 rotor and 12 or 24 friction columns, unscaled."""
    robot = load_robot("er3a")
    base = find_base_parameters(default_model(robot, friction=FRICTION[columns], velocity_scale=0.02, offset=False))
    if base.size != columns:
        raise SystemExit(f"{base.size} columns instead of {columns}")
    return FourierProblem(base=base, criterion=criterion("cond"), limits=usable_limits(robot.limits))


def ours(problem: FourierProblem, seed: int, clock: Clock, *, solver: Solver) -> None:
    """The search of ``oed design`` on one island, without its finish on a finer grid."""

    def tell(_: int, best: float) -> None:
        clock.note(best)
        clock.check()

    Island(problem, replace(EFFORTS["thorough"], hops=100_000), solver, seed, 0, tell=tell).search()


def pulled_in(problem: FourierProblem, clock: Clock) -> Callable[[Array], float]:
    """The condition number of a point pulled within the limits; improvements are noted on the fine grid."""
    fine, best = replace(problem, samples=FINE_SAMPLES), np.inf

    def objective(z: Array) -> float:
        nonlocal best
        clock.check()
        inside = problem.shrunk(z)
        value = problem.cost(inside)
        if value < best:
            best = value
            clock.note(fine.cost(inside))
        return value

    return objective


def evolution(problem: FourierProblem, seed: int, clock: Clock) -> None:
    """Scipy's differential evolution, two individuals an unknown, every one of them pulled within the limits."""
    bounds = [(-BOX, BOX)] * problem.size
    differential_evolution(pulled_in(problem, clock), bounds, popsize=2, maxiter=10**6, tol=0, polish=False, rng=seed)


def genetic(problem: FourierProblem, seed: int, clock: Clock) -> None:
    """Pymoo's genetic algorithm as it comes (100 individuals), every one of them pulled within the limits."""
    from pymoo.algorithms.soo.nonconvex.ga import GA
    from pymoo.core.problem import ElementwiseProblem
    from pymoo.optimize import minimize as optimize

    objective = pulled_in(problem, clock)

    class Excitation(ElementwiseProblem):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__(n_var=problem.size, n_obj=1, xl=-BOX, xu=BOX)

        def _evaluate(self, x: Array, out: dict[str, float], *_: object, **__: object) -> None:
            out["F"] = objective(x)

    optimize(Excitation(), GA(pop_size=100), ("n_gen", 10**6), seed=seed, verbose=False)


def slsqp(problem: FourierProblem, seed: int, clock: Clock, *, helped: bool = False) -> None:
    """Scipy's SLSQP on log cond, gradients by finite differences, from one start after the other.

    It gets all limit rows at 100 samples and random starts; helped, it gets our screened starts and our working set.
    """
    fine, rng = replace(problem, samples=FINE_SAMPLES), np.random.default_rng(seed)
    rows = problem if helped else replace(problem, limit_samples=100)

    def objective(z: Array) -> float:
        clock.check()
        return float(np.log(problem.cost(z)))

    def note(z: Array) -> None:
        clock.note(fine.cost(problem.shrunk(z)))

    while True:
        points = [problem.shrunk(rng.normal(size=problem.size), 0.95) for _ in range(100 if helped else 1)]
        z, working = min(points, key=problem.cost), WorkingSet(rows, stride=25 if helped else 1)
        for _ in range(4 if helped else 1):
            matrix, offset = working.matrix()
            limits = LinearConstraint(np.array(matrix.full()), -1 - offset, 1 - offset)
            options = {"maxiter": 60 if helped else 300, "ftol": 1e-4}
            z = minimize(objective, z, method="SLSQP", constraints=limits, callback=note, options=options).x
            if not helped or not working.add_peaks(z, 1e-3):
                break
        note(z)


SEARCHES: dict[str, Callable[[FourierProblem, int, Clock], None]] = {
    OURS: partial(ours, solver=InteriorPoint()),
    EXACT: partial(ours, solver=Slsqp()),
    EVOLUTION: evolution,
    GENETIC: genetic,
    SLSQP: slsqp,
    HELPED: partial(slsqp, helped=True),
}


RIVALS = {"de": EVOLUTION, "ga": GENETIC, "slsqp": SLSQP, "helped": HELPED, "exact": EXACT}


def run(task: Task) -> Trace:
    """Searches until the time is over."""
    warnings.simplefilter("ignore")
    problem = problem_of(task.columns)
    problem.cost(np.zeros(problem.size))  # compiled, or read from the cache
    replace(problem, samples=FINE_SAMPLES).cost(np.zeros(problem.size))
    clock = Clock(task.budget)
    with suppress(OverError):
        SEARCHES[task.who](problem, task.seed, clock)
    return clock.trace


def processor() -> str:
    """Names the machine's processor."""
    with suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def at(trace: Trace, seconds: float) -> float:
    """The best value after so many seconds."""
    return min((value for when, value in trace if when <= seconds), default=np.inf)


def reached(trace: Trace, value: float) -> float:
    """When a value was reached."""
    return next((when for when, best in trace if best <= value), np.inf)


def tasks(budget: float, columns: list[int], seeds: int, chosen: list[str]) -> list[Task]:
    """Every rival gets the budget once; ours and SLSQP in our search get half a minute a seed."""
    rivals = [RIVALS[name] for name in chosen if name != "exact" and (name != "ga" or find_spec("pymoo"))]
    plan = [Task(who, c, 0, budget) for c in columns for who in rivals]
    paired = [EXACT, OURS] if "exact" in chosen else [OURS]
    return plan + [Task(who, c, s, min(OUR_SECONDS, budget)) for c in columns for s in range(seeds) for who in paired]


def table(columns: int, results: list[tuple[Task, Trace]]) -> None:
    """Prints the best condition number over time, then the ratios."""
    chosen = [(task, trace) for task, trace in results if task.columns == columns]
    chosen.sort(key=lambda entry: (list(SEARCHES).index(entry[0].who), entry[0].seed))
    print(f"{columns} columns: best cond(Y) after so many seconds")
    print(f"  {'':28}seed" + "".join(f"{moment:>8} s" for moment in MOMENTS))
    for task, trace in chosen:
        cells = (f"{at(trace, m):10.2f}" if m <= task.budget + 1 else f"{'':10}" for m in MOMENTS)
        print(f"  {task.who:28}{task.seed:4}" + "".join(cells).rstrip())
    for who in (rival for rival in RIVALS.values() if rival != EXACT):
        traces = [trace for task, trace in chosen if task.who == who and trace]
        if not traces:
            continue
        best = min(traces, key=lambda trace: trace[-1][1])
        when, value = best[-1]
        times = [reached(trace, value) for task, trace in chosen if task.who == OURS]
        mine = float(np.median(times))
        verdict = f"{when / mine:.0f} times as fast" if np.isfinite(mine) else "which ours did not reach"
        print(f"  {who} needs {when:.0f} s to its best, {value:.2f}; ours {mine:.1f} s: {verdict}")
    ends = [[trace[-1][1] for task, trace in chosen if task.who == who and trace] for who in (EXACT, OURS)]
    if all(ends):
        exact, mine = (float(np.median(values)) for values in ends)
        print(f"  {EXACT}, at the same time: {exact:.2f}; ours {mine:.2f}; medians of the seeds")
    print()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--budget", type=float, default=600.0, help="seconds of each rival")
    parser.add_argument("--columns", type=int, nargs="+", default=list(FRICTION), choices=list(FRICTION))
    parser.add_argument("--rivals", nargs="+", default=list(RIVALS), choices=list(RIVALS))
    parser.add_argument("--seeds", type=int, default=3, help="of ours")
    parser.add_argument("--workers", type=int, default=min(2, available_cores()), help="searches at a time")
    options = parser.parse_args()
    warnings.simplefilter("ignore", AssumedValueWarning)
    start = time.perf_counter()
    for columns in options.columns:
        problem = problem_of(columns)
        problem.cost(np.zeros(problem.size))
    compiled = time.perf_counter() - start
    plan = tasks(options.budget, options.columns, options.seeds, options.rivals)
    print(f"{processor()}; Python {platform.python_version()}, scipy {scipy.__version__}; one thread each")
    print(f"compiled, or read from the cache, in {compiled:.1f} s")
    print(f"budgets: {options.budget:.0f} s each; ours {plan[-1].budget:.0f} s\n", flush=True)
    results = list(zip(plan, parallel_map(run, plan, workers=options.workers), strict=True))
    for columns in options.columns:
        table(columns, results)
    return 0


if __name__ == "__main__":
    sys.exit(main())
