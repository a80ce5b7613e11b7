"""IPOPT on a design problem, with exact gradients and only those limit rows that matter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import casadi
import numpy as np

from oed.experiments.problems.objective import Objective, Watch
from oed.experiments.problems.pointwise_function import PointwiseFunction
from oed.experiments.problems.pointwise_rows import PointwiseRows
from oed.experiments.problems.problem import FourierProblem
from oed.experiments.problems.trap import Trap
from oed.experiments.problems.working_set import WorkingSet
from oed.experiments.solvers.base import PASSED, Solved, Solver, Stage, Tell, go_on
from robots.common.arrays import Array

# IPOPT's last word when CasADi noticed Ctrl-C before Python did.
INTERRUPTED = ("User_Requested_Stop", "NonIpopt_Exception_Thrown")


@dataclass(frozen=True, kw_only=True)
class Ipopt(Solver):
    """Settings of IPOPT; see `Solver` for what all solvers share.

    Attributes:
        history: of the limited-memory Hessian.
        rounds: how often rows that a solution passes are added and the stage is solved again.
    """

    name: ClassVar[str] = "ipopt"
    barriers: ClassVar[tuple[float, float, float]] = (1e-2, 1e-3, 1e-4)

    history: int = 10
    rounds: int = 2

    def minimise(
        self,
        problem: FourierProblem,
        start: Array,
        stages: Sequence[Stage],
        *,
        tell: Tell = go_on,
    ) -> Solved:
        """See `Solver.minimise`."""
        trap = Trap()
        objective, working, pointwise = Objective(problem, trap), WorkingSet(problem), PointwiseRows(problem)
        pointwise.add_peaks(start, PASSED)
        z, iterations, status, going = start, 0, "no iteration", True

        def watch(value: float) -> bool:
            nonlocal going
            going = going and tell(stage.sharpness, value)
            return going

        for stage in stages:
            objective.forget(stage.sharpness)
            max_iter, barrier = stage.max_iter, stage.barrier
            for _ in range(self.rounds):
                run = _Run(objective, working, pointwise, self, max_iter, barrier, watch, trap)
                z, count, status = run.solve(z)
                trap.release()
                if status in INTERRUPTED and going:
                    raise KeyboardInterrupt
                iterations += count
                passed = [rows.add_peaks(z, PASSED) for rows in (working, pointwise)]
                if not going or not any(passed):
                    break
                max_iter, barrier = max(10, max_iter // 2), barrier / 10
            z = problem.shrunk(z)
            if not going:
                break
        return Solved(z=z, iterations=iterations, evaluations=objective.evaluations, status=status)


class _Run:
    """One call of IPOPT on the rows of the moment."""

    def __init__(
        self,
        objective: Objective,
        working: WorkingSet,
        pointwise: PointwiseRows,
        settings: Ipopt,
        max_iter: int,
        barrier: float,
        watch: Callable[[float], bool],
        trap: Trap,
    ) -> None:
        matrix, offset = working.matrix()
        size = objective.problem.size
        z = casadi.MX.sym("z", size)
        lower, upper = pointwise.bounds()
        self._lower, self._upper = np.concatenate([-1 - offset, lower]), np.concatenate([1 - offset, upper])
        self._curved = PointwiseFunction(pointwise, size, trap) if pointwise.size else None
        rows = matrix @ z if self._curved is None else casadi.vertcat(matrix @ z, self._curved(z))
        # CasADi holds no reference to a callback: this object does.
        self._watch = Watch(size, len(self._lower), watch, trap)
        ipopt: dict[str, Any] = {
            "print_level": 0,
            "sb": "yes",
            "hessian_approximation": "limited-memory",
            "limited_memory_max_history": settings.history,
            "limited_memory_initialization": "scalar2",
            "mu_strategy": "monotone",
            "mu_init": barrier,
            "max_iter": max_iter,
            "max_soc": 0,
            "tol": settings.tolerance,
            "jac_d_constant": "yes" if self._curved is None else "no",
            "nlp_scaling_method": "none",
            "bound_relax_factor": 0.0,
            "bound_push": 1e-6,
            "bound_frac": 1e-6,
            "slack_bound_push": 1e-6,
            "slack_bound_frac": 1e-6,
        }
        options: dict[str, Any] = {
            "print_time": False,
            "error_on_fail": False,
            "calc_lam_p": False,
            "calc_lam_x": False,
            "iteration_callback": self._watch,
            "ipopt": ipopt,
        }
        problem: dict[str, Any] = {"x": z, "f": objective(z), "g": rows}
        self._solver = casadi.nlpsol("design", "ipopt", problem, options)

    def solve(self, z: Array) -> tuple[Array, int, str]:
        """Returns the last iterate, the number of iterations and IPOPT's status."""
        result = self._solver(x0=z, lbg=self._lower, ubg=self._upper)
        statistics = self._solver.stats()
        return np.array(result["x"]).ravel(), int(statistics["iter_count"]), str(statistics["return_status"])
