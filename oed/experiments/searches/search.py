"""The search for the best design: screened starts, hops from the best of them, and a finish on the criterion itself."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from oed.criteria import triangle
from oed.experiments.problems.problem import FourierProblem
from oed.experiments.solvers import Solved, Solver, Stage
from oed.experiments.solvers.base import Tell
from oed.trajectories import count_periods
from robots.common.arrays import Array
from robots.common.errors import InputError

# How far a hop throws the coefficients of a joint, in units of what brings it to its limits.
THROWS = (0.15, 0.3, 0.6)

# Per period, by which designs are compared.
FINE_SAMPLES = 1000

# Screening checks only every fifth limit sample. The start that it chooses is then pulled within the limits at all.
SCREENING_STRIDE = 5
INTERRUPTED = "interrupted"

# A hop may be behind the best design by this much of the stand-in, a logarithm, when its first stage ends; before, by
# twice as much for each so many iterations that are left; and by less in later stages.
LAG, HALVED_IN, LAG_LATER = 0.04, 15, 0.01
# Iterations of a stage before which a hop is not judged.
LOOK = 10


@dataclass(frozen=True, kw_only=True)
class Effort:
    """How long to search, in counts: the same seed gives the same design however fast the machine is.

    Attributes:
        islands: independent searches, in parallel processes.
        starts: random starts on each.
        screened: random points from which each start takes its best.
        hops: how often the best designs are thrown and solved again.
        finish_samples: per period, for the finish.

    Raises:
        InputError: a count that is no whole number, or too small.
    """

    islands: int = 2
    starts: int = 10
    screened: int = 100
    hops: int = 60
    finish_samples: int = 400

    def __post_init__(self) -> None:
        """Checks the counts."""
        for name, least in (("islands", 1), ("starts", 1), ("screened", 1), ("hops", 0), ("finish_samples", 20)):
            value = getattr(self, name)
            if value != int(value) or value < least:
                raise InputError(f"{name} is {value}", allowed=f"a whole number, at least {least}")

    @property
    def steps(self) -> int:
        """Local solutions on one island, its refinements and finish included."""
        return self.starts + max(1, self.starts // 3) + self.hops + 1


EFFORTS = {
    "quick": Effort(islands=1, starts=5, hops=16, finish_samples=200),
    "standard": Effort(),
    "thorough": Effort(hops=400),
}


@dataclass(frozen=True, kw_only=True)
class Found:
    """What one island came to.

    Attributes:
        number: of the island.
        z: its best design (n K,).
        cost: the criterion at the controller's samples, smaller being better; infinite where a parameter is not
            excited.
        value: the criterion as people read it.
        initial: the same of its first feasible point.
        iterations: of the local solver.
        evaluations: of the criterion with its gradient.
        status: ``finished``, or what stopped it early.
        starts: of each random start, the criterion there and of what the first solution made of it.
    """

    number: int
    z: Array
    cost: float
    value: float
    initial: float
    iterations: int
    evaluations: int
    status: str
    starts: tuple[tuple[float, float], ...] = ()


class Island:
    """One independent search; all that it does follows from the problem, the seed and its number.

    Args:
        problem: the design problem.
        effort: how long to search.
        settings: the local solver and its settings.
        seed: of the whole design.
        number: of this island.
        tell: called after each local solution with the number done and the best value so far.
        deadline: as `time.time` counts, for islands of one design may run one after the other or on several machines;
            after it the best design so far is kept.
        halted: asked again and again whether to end early with the best design so far.
    """

    def __init__(
        self,
        problem: FourierProblem,
        effort: Effort,
        settings: Solver,
        seed: int,
        number: int,
        *,
        tell: Callable[[int, float], None] = lambda done, best: None,
        deadline: float = np.inf,
        halted: Callable[[], bool] = lambda: False,
    ) -> None:
        self._problem, self._effort, self._settings = problem, effort, settings
        self._fine = problem.resampled(FINE_SAMPLES)
        self._rng = np.random.default_rng([seed, number])
        self._number, self._tell, self._deadline, self._halted = number, tell, deadline, halted
        self._starts: list[tuple[float, float]] = []
        self._iterations = self._evaluations = self._done = 0
        self._best = np.inf

    def search(self) -> Found:
        """Runs the search."""
        criterion, settings = self._problem.criterion, self._settings
        rough, *sharper = criterion.stages
        fresh, known, _ = settings.barriers
        first = Stage(sharpness=rough, max_iter=settings.max_iter * 4 // 3, barrier=fresh)
        again = [Stage(sharpness=p, max_iter=settings.max_iter, barrier=known) for p in (rough, *sharper)]
        start = self._screen()
        initial = dense(self._problem, start)[1]
        pool = [(self._cost(start), start)]
        for number in range(self._effort.starts):
            if self._in_time():
                point = start if not number else self._screen()
                pool.append(self._solve(point, [first]))
                self._starts.append((self._as_read(point), self._as_read(pool[-1][1])))
        pool.sort(key=_by_cost)
        # Several starts end in the same few valleys: only the best are worth sharpening.
        pool = [*pool[:1], *(self._solve(z, again) for _, z in pool[: max(1, self._effort.starts // 3)])]
        for hop in range(self._effort.hops):
            pool = sorted(pool, key=_by_cost)[:4]
            if self._in_time():
                pool.append(self._solve(self._thrown(pool, hop), again, self._race(pool[0][1], again)))
        best = min(pool, key=_by_cost)[1]
        best = self._finish(best)
        cost, value = dense(self._problem, best)
        return Found(
            number=self._number,
            z=best,
            cost=cost,
            value=value,
            initial=initial,
            iterations=self._iterations,
            evaluations=self._evaluations,
            status=self._status(),
            starts=tuple(self._starts),
        )

    def _in_time(self) -> bool:
        return time.time() < self._deadline and not self._halted()

    def _still(self, sharpness: float, value: float) -> bool:
        return self._in_time()

    def _status(self) -> str:
        if self._halted():
            return INTERRUPTED
        return "finished" if self._in_time() else "stopped at the time limit"

    def _as_read(self, z: Array) -> float:
        return (-1.0 if self._problem.criterion.larger_is_better else 1.0) * self._cost(z)

    def _screen(self) -> Array:
        problem = self._problem
        drawn = (self._rng.normal(size=problem.size) for _ in range(self._effort.screened))
        rough = (problem.shrunk(z, 0.95, halvings=6, stride=SCREENING_STRIDE) for z in drawn)
        return problem.shrunk(min(rough, key=problem.cost))

    def _thrown(self, pool: list[tuple[float, Array]], hop: int) -> Array:
        """Throws one or two joints' coefficients of the best design, or now and then of one of the next best."""
        rng, joints = self._rng, self._problem.joints
        chosen = 0 if hop % 3 else min(int(rng.integers(3)), len(pool) - 1)
        z = pool[chosen][1].reshape(joints, -1).copy()
        moved = rng.choice(joints, size=min(joints, 1 + hop % 2), replace=False)
        z[moved] += THROWS[int(rng.integers(3))] * rng.normal(size=(len(moved), z.shape[1]))
        return self._problem.shrunk(z.reshape(-1), 0.99)

    def _race(self, best: Array, stages: list[Stage]) -> Tell:
        """Ends a hop that will not come to the best design: half of them are known by their first twenty iterations."""
        rivals = {stage.sharpness: self._problem.surrogate(best, stage.sharpness)[0] for stage in stages}
        first, most, seen = stages[0].sharpness, stages[0].max_iter, dict.fromkeys(rivals, 0)

        def tell(sharpness: float, value: float) -> bool:
            seen[sharpness] += 1
            left, behind = most - seen[sharpness], value - rivals[sharpness]
            allowed = LAG * 2 ** (left / HALVED_IN) if sharpness == first else LAG_LATER
            return (seen[sharpness] < LOOK or behind <= allowed) and self._in_time()

        return tell

    def _solve(self, start: Array, stages: list[Stage], tell: Tell | None = None) -> tuple[float, Array]:
        if not self._in_time():
            return np.inf, start
        solved = self._settings.minimise(self._problem, start, stages, tell=tell or self._still)
        return self._count(solved, self._cost(solved.z)), solved.z

    def _cost(self, z: Array) -> float:
        # On a grid that the optimiser did not see: it would profit from where the samples of its own happen to lie.
        return self._fine.cost(z)

    def _count(self, solved: Solved, cost: float) -> float:
        self._iterations += solved.iterations
        self._evaluations += solved.evaluations
        self._best = min(self._best, cost)
        self._done += 1
        self._tell(self._done, self._best)
        return cost

    def _finish(self, z: Array) -> Array:
        """Sharpens the stand-in on a finer grid until it is the criterion, keeping each stage that brings something."""
        problem = self._problem.resampled(self._effort.finish_samples)
        best, best_cost, barrier = z, dense(problem, z)[0], self._settings.barriers[2]
        for sharpness in problem.criterion.finish or problem.criterion.stages:
            if not self._in_time():
                break
            stage = Stage(sharpness=sharpness, max_iter=self._settings.finish_iter, barrier=barrier)
            solved = self._settings.minimise(problem, best, [stage], tell=self._still)
            self._iterations += solved.iterations
            self._evaluations += solved.evaluations
            cost = dense(problem, solved.z)[0]
            if cost < best_cost:
                best, best_cost = solved.z, cost
            barrier = max(barrier / 3, self._settings.tolerance / 10)
        self._done += 1
        self._tell(self._done, best_cost)
        return best


def dense(problem: FourierProblem, z: Array) -> tuple[float, float]:
    """Evaluates cost and value of the criterion on one period at the controller's period, as the file will have it."""
    robot = problem.base.model.robot
    t = robot.period * np.arange(count_periods(problem.family.duration, robot.period))
    q, dq, ddq, _ = problem.series(z).sample(t)
    weighting = problem.weighting
    reduced = triangle(problem.base.model, problem.base.independent, q, dq, ddq, weighting.rows)
    values = weighting.singular_values(reduced, len(t))
    if values[0] < 1e-10 * values[-1]:
        return np.inf, np.nan
    return problem.criterion.cost(values**2), problem.criterion.value(values**2)


def _by_cost(entry: tuple[float, Array]) -> float:
    return entry[0]
