"""The fastest timing of a path under limits that need not be convex, by an interior-point method.

Each unknown meets only its two neighbours on either side, so a Newton step costs a banded solve: time linear in the
length of the path. All iterates keep the limits; a solve that ends early is still a timing.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import LinAlgError, solveh_banded

from oed.retiming.timing_problem import TimingProblem
from robots.common.arrays import Array


def shorten(problem: TimingProblem, coefficients: Array, *, first_weight: float = 1.0) -> Array:
    """Minimises the duration from a timing strictly within the limits.

    kappa T(x) - sum log(1 - r^2), T = sum width / sqrt(x), for growing kappa. The Hessian leaves out the curvature of
    the rows r, so that it is positive definite; steps are shortened to stay inside.

    Args:
        problem: the limits.
        coefficients: of x = (ds/dt)^2, (K+2,).
        first_weight: of the duration against the barrier at the beginning, in points over durations.

    Returns:
        Better coefficients, (K+2,), strictly within the limits.
    """
    c = coefficients
    duration = float((problem.width / np.sqrt(problem.squared_speed(c))).sum())
    weight = first_weight * problem.s.size / duration
    # Weights of the barrier, and Newton steps of each.
    for _ in range(6):
        for _ in range(12):
            gradient, band = _quadratic(problem, c, weight)
            band[2] *= 1.0 + 1e-12
            try:
                step = -solveh_banded(band, gradient)
            except LinAlgError:
                return c
            decrement = -float(gradient @ step)
            moved = _descend(problem, c, step, weight, decrement)
            if moved is None:
                break
            c = moved
            # Below: the change would not be seen in the duration.
            if decrement < 1e-4 * weight * duration:
                break
        weight *= 6.0
    return c


def inside(problem: TimingProblem, coefficients: Array) -> bool:
    """Whether a timing keeps all limits strictly."""
    return _merit(problem, coefficients, 0.0) is not None


def _merit(problem: TimingProblem, c: Array, weight: float) -> float | None:
    x = problem.squared_speed(c)
    if not np.all((x > 0.0) & (x < problem.ceiling)):
        return None
    r = problem.values(c)
    if not np.all(np.abs(r) < 1.0):
        return None
    barrier = np.log1p(-x / problem.ceiling).sum() + np.log1p(-(r**2)).sum()
    return float(weight * (problem.width / np.sqrt(x)).sum() - barrier)


def _quadratic(problem: TimingProblem, c: Array, weight: float) -> tuple[Array, Array]:
    """Gradient (K+2,) and upper band (3, K+2) of the Hessian of the merit."""
    x = problem.squared_speed(c)
    use = problem.usage(c)
    r, slack = use.values, 1.0 - use.values**2
    over = 1.0 / (problem.ceiling - x)
    first = over - 0.5 * weight * problem.width * x**-1.5
    second = over**2 + 0.75 * weight * problem.width * x**-2.5
    local = first[:, None] * problem.b0 + np.einsum("mr,mrk->mk", 2.0 * r / slack, use.gradients)
    curved = (np.sqrt(2.0 * (1.0 + r**2)) / slack)[:, :, None] * use.gradients
    square = np.matmul(curved.transpose(0, 2, 1), curved)
    square += second[:, None, None] * problem.b0[:, :, None] * problem.b0[:, None, :]
    size = problem.grid.size
    gradient = np.zeros(size)
    band = np.zeros((3, size))
    for i in range(3):
        gradient += np.bincount(problem.cell + i, local[:, i], size)
        for j in range(i, 3):
            band[2 - (j - i)] += np.bincount(problem.cell + j, square[:, i, j], size)
    return gradient, band


def _descend(problem: TimingProblem, c: Array, step: Array, weight: float, decrement: float) -> Array | None:
    here = _merit(problem, c, weight)
    if here is None:
        return None
    length = 1.0
    for _ in range(30):
        there = _merit(problem, c + length * step, weight)
        if there is not None and there <= here - 1e-4 * length * decrement:
            return c + length * step
        length /= 2.0
    return None
