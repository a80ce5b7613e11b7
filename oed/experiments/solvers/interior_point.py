"""A feasible interior-point method with a dense quasi-Newton Hessian, made for some hundred unknowns and many limits.

IPOPT spends two thirds of a design's time on the sparse algebra of slacks and multipliers. Here the limits of each
joint share one small block of rows, so that all of them are condensed into the Hessian of the unknowns.

Every iterate is within all limits at all samples. Of the limits on torque and in space only those that the motion comes
near are rows with derivatives. A step that would pass another limit makes it a row. So no solution has to be pulled
within limits that the solver did not see, which would cost it much of what it gained.

Source: Nocedal and Wright, Numerical Optimization, 2nd ed., sections 18.3 (damped BFGS) and 19.3; Waechter and Biegler
2006 for the barrier's schedule.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.linalg.lapack import dposv

from oed.experiments.problems.problem import FourierProblem
from oed.experiments.solvers.base import Solved, Solver, Stage, Tell, go_on
from oed.experiments.solvers.curved_slacks import CurvedSlacks
from oed.experiments.solvers.slacks import LinearSlacks, Slacks
from robots.common.arrays import Array

ARMIJO = 1e-4
HALVINGS = 12
# How often a direction is sought again with those limits as rows that cut its step.
REDIRECTED = 4
# Multipliers stay within this factor of mu / slack, as IPOPT's do.
DRIFT = 1e10


@dataclass(frozen=True, kw_only=True)
class InteriorPoint(Solver):
    """Settings of the feasible interior-point method; see `Solver`."""

    name: ClassVar[str] = "interior-point"
    barriers: ClassVar[tuple[float, float, float]] = (1e-4, 1e-4, 1e-5)

    def minimise(
        self,
        problem: FourierProblem,
        start: Array,
        stages: Sequence[Stage],
        *,
        tell: Tell = go_on,
    ) -> Solved:
        """See `Solver.minimise`."""
        descent = _Descent(problem, start, self.tolerance, tell)
        for stage in stages:
            descent.run(stage.sharpness, stage.max_iter, stage.barrier)
            if descent.stopped:
                break
        return Solved(
            z=problem.shrunk(descent.z),
            iterations=descent.iterations,
            evaluations=descent.evaluations,
            status=descent.status,
        )


class _Descent:
    """An iterate, its quasi-Newton Hessian, and the iterations that improve both."""

    def __init__(self, problem: FourierProblem, start: Array, tolerance: float, tell: Tell) -> None:
        self._problem, self._tolerance, self._tell = problem, tolerance, tell
        self._linear = LinearSlacks(problem)
        self.z = start
        # A unit of z brings a joint to its limits, and the criteria are logarithms: curvatures are of the order of one.
        # The usual first scaling takes the largest curvature for all directions. Its short steps end in worse optima.
        self._hessian: Array = np.eye(problem.size)
        self.iterations = self.evaluations = 0
        self.stopped = False
        self.status = "no iteration"

    def run(self, sharpness: float, max_iter: int, mu: float) -> None:
        """Minimises the stand-in of one sharpness."""
        z, (f, g) = self.z, self._problem.surrogate(self.z, sharpness)
        self.evaluations += 1
        slacks = Slacks(self._linear, CurvedSlacks(self._problem, z))
        s, _ = slacks.values(z)
        slacks.linearise(z)
        multipliers = mu / s
        self.status = "iterations used up"
        for _ in range(max_iter):
            mu = self._lowered(mu, np.abs(g - slacks.pullback(multipliers)).max(), s, multipliers)
            if mu == 0.0:
                self.status = "solved"
                break
            for left in reversed(range(REDIRECTED + 1)):
                gradient = g - slacks.pullback(mu / s)
                p = self._direction(slacks, multipliers / s, gradient)
                change = slacks.change(p)
                step = min(1.0, _to_the_boundary(s, change, mu))
                if not left or not slacks.choose(z + step * p):
                    break
                # A limit that was no row cuts the step. As a row it turns the direction away from itself.
                s, _ = slacks.values(z)
                slacks.linearise(z)
                multipliers = np.append(multipliers, mu / s[len(multipliers) :])
            taken = self._searched(slacks, sharpness, z, f, s, p, step, float(gradient @ p), mu)
            if taken is None:
                self.status = "no further progress"
                break
            # First order in the slacks: the multipliers' Newton step towards s * multiplier = mu.
            push = mu / s - multipliers - multipliers / s * change
            multipliers = multipliers + min(1.0, _to_the_boundary(multipliers, push, mu)) * push
            new, f, slope, s = taken
            multipliers = np.clip(multipliers, mu / s / DRIFT, mu / s * DRIFT)
            y = slope - g + slacks.bend(multipliers)
            slacks.linearise(new)
            self._learn(new - z, y - slacks.bend(multipliers))
            z, g = new, slope
            self.z = z
            self.iterations += 1
            if not self._tell(sharpness, f):
                self.stopped, self.status = True, "stopped"
                break

    def _lowered(self, mu: float, residual: float, s: Array, multipliers: Array) -> float:
        """The barrier parameter of the next step: smaller where the present one is solved well enough; 0 at the end."""
        products, least = s * multipliers, self._tolerance / 10
        while max(residual, np.abs(products - mu).max()) < 10 * mu:
            if mu <= least:
                return 0.0 if max(residual, products.max()) < self._tolerance else mu
            mu = max(least, min(0.2 * mu, mu**1.5))
        return mu

    def _direction(self, slacks: Slacks, weights: Array, gradient: Array) -> Array:
        size = len(gradient)
        while True:
            matrix = self._hessian.copy()
            slacks.add_normal(matrix, weights)
            _, p, failed = dposv(matrix, -gradient)
            if not failed:
                return np.asarray(p, dtype=np.float64)
            # Rounding made the Hessian indefinite: what it knew of directions is given up, its size is kept.
            self._hessian = np.eye(size) * max(float(np.abs(np.diag(self._hessian)).mean()), 1e-8) * 10

    def _searched(
        self,
        slacks: Slacks,
        sharpness: float,
        z: Array,
        f: float,
        s: Array,
        p: Array,
        step: float,
        slope: float,
        mu: float,
    ) -> tuple[Array, float, Array, Array] | None:
        """Goes along p until the barrier function falls enough; point, value, gradient and slacks there, or None."""
        before = f - mu * np.log(s).sum()
        for _ in range(HALVINGS):
            new = z + step * p
            there, others = slacks.values(new)
            if not others or there.min() <= 0:  # a curved limit bends away
                step /= 2
                continue
            self.evaluations += 1
            value, gradient = self._problem.value_first(new, sharpness)
            rise = value - mu * np.log(there).sum() - before
            if rise <= ARMIJO * step * slope:
                return new, value, gradient(), there
            curvature = (rise - step * slope) / step**2
            step = float(np.clip(-slope / (2 * curvature) if curvature > 0 else 0.0, 0.1 * step, 0.5 * step))
        return None

    def _learn(self, moved: Array, y: Array) -> None:
        """Updates the Hessian by Powell's damped BFGS, which keeps it positive definite."""
        sy = float(moved @ y)
        image = self._hessian @ moved
        quadratic = float(moved @ image)
        if quadratic <= 0 or not np.isfinite(sy):
            return
        if sy < 0.2 * quadratic:
            share = 0.8 * quadratic / (quadratic - sy)
            y = share * y + (1 - share) * image
            sy = float(moved @ y)
        self._hessian = self._hessian + np.outer(y, y) / sy - np.outer(image, image) / quadratic


def _to_the_boundary(values: Array, change: Array, mu: float) -> float:
    """The step at which the first of some positive values has used up 99 % of itself, more as mu goes to zero."""
    fastest = float((-change / values).max())
    return max(0.99, 1 - mu) / fastest if fastest > 0 else np.inf
