"""SLSQP of scipy on a design problem, with exact gradients and only those limit rows that matter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from scipy.optimize import OptimizeResult, minimize

from oed.experiments.problems.pointwise_rows import PointwiseRows
from oed.experiments.problems.problem import FourierProblem
from oed.experiments.problems.working_set import WorkingSet
from oed.experiments.solvers.base import PASSED, Solved, Solver, Stage, Tell, go_on
from robots.common.arrays import Array


@dataclass(frozen=True, kw_only=True)
class Slsqp(Solver):
    """Settings of sequential least squares programming (Kraft 1988); see `Solver` for what all solvers share.

    Attributes:
        rounds: how often rows that a solution passes are added and the stage is solved again.
    """

    name: ClassVar[str] = "slsqp"
    barriers: ClassVar[tuple[float, float, float]] = (0.0, 0.0, 0.0)  # it has none

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
        working, pointwise = WorkingSet(problem), PointwiseRows(problem)
        pointwise.add_peaks(start, PASSED)
        z, iterations, evaluations, status, going = start, 0, 0, "no iteration", True

        def watch(intermediate_result: OptimizeResult) -> None:
            nonlocal going
            going = going and tell(stage.sharpness, float(intermediate_result.fun))
            if not going:
                raise StopIteration

        for stage in stages:
            max_iter, before = stage.max_iter, z
            for _ in range(self.rounds):
                result = minimize(
                    problem.surrogate,
                    z,
                    args=(stage.sharpness,),
                    jac=True,
                    method="SLSQP",
                    constraints=_limits(working, pointwise),
                    callback=watch,
                    options={"maxiter": max_iter, "ftol": self.tolerance},
                )
                z, status = np.asarray(result.x, dtype=np.float64), str(result.message)
                iterations += int(result.nit)
                evaluations += int(result.nfev)
                passed = [rows.add_peaks(z, PASSED) for rows in (working, pointwise)]
                if not going or not any(passed):
                    break
                max_iter = max(10, max_iter // 2)
            # Pulled within the limits, what was better may be worse than the stage's start.
            z = min(problem.shrunk(z), before, key=lambda point: problem.surrogate(point, stage.sharpness)[0])
            if not going:
                break
        return Solved(z=z, iterations=iterations, evaluations=evaluations, status=status)


def _limits(working: WorkingSet, pointwise: PointwiseRows) -> list[Any]:
    """Writes the rows of the moment as functions that stay at or above zero, with their Jacobians."""
    sparse, offset = working.matrix()
    matrix = np.array(sparse.full())
    slopes = np.concatenate([-matrix, matrix])
    limits: list[dict[str, Any]] = [
        {"type": "ineq", "fun": lambda z: 1 + slopes @ z + np.append(-offset, offset), "jac": lambda z: slopes}
    ]
    if pointwise.size:
        lower, upper = pointwise.bounds()
        below, above = np.isfinite(lower), np.isfinite(upper)

        def room(z: Array) -> Array:
            values = pointwise.values(z)
            return np.concatenate([values[below] - lower[below], upper[above] - values[above]])

        def room_slopes(z: Array) -> Array:
            jacobian = pointwise.jacobian(z)
            return np.concatenate([jacobian[below], -jacobian[above]])

        limits.append({"type": "ineq", "fun": room, "jac": room_slopes})
    return limits
