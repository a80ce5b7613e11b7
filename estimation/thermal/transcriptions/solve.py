"""The two ways to minimise: IPOPT over states and coordinates, or over the coordinates alone where memory is long."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from estimation.thermal.transcriptions.transcription import Solution, Transcription
from robots.common.arrays import Array


def solve(
    problem: Transcription,
    coordinates: Array,
    free: NDArray[np.bool_],
    weights: Array,
    prior: Array,
    *,
    slow: tuple[float, float] | None = None,
    max_iterations: int = 200,
) -> Solution:
    """Minimises the weighted squares from a start.

    Args:
        problem: the runs, discretised.
        coordinates: where to begin; those that are not free stay (P,).
        free: which coordinates may move (P,).
        weights: of the measurements (M,), one over their standard deviations.
        prior: one over the standard deviations of the runs' surroundings (R,), of their coordinates.
        slow: a power [W], and the slowest time constant at it [s] that is to be kept.
        max_iterations: of the solver.

    Returns:
        The end, successful or not.
    """
    lower, upper = problem.layout.bounds()
    begin = np.where(free, np.clip(coordinates, lower + 1e-9, upper - 1e-9), coordinates)
    # More states than these make IPOPT's steps dear, while eliminating them stays cheap.
    if problem.state_size > 4:
        return _solve_reduced(problem, begin, free, (weights, prior), slow)
    return problem.solve(begin, free, weights, prior, slow=slow, max_iterations=max_iterations)


def _solve_reduced(
    problem: Transcription,
    begin: Array,
    free: NDArray[np.bool_],
    weights: tuple[Array, Array],
    slow: tuple[float, float] | None,
) -> Solution:
    """Minimises over the coordinates alone, the states of the collocation eliminated with their exact derivatives."""
    rows, prior = weights
    lower, upper = problem.layout.bounds()
    slots, which = problem.layout.ambient_slots, np.flatnonzero(free)
    latest: dict[str, Any] = {}

    def at(moved: Array) -> tuple[Array, Array]:
        if latest.get("at") is None or not np.array_equal(latest["at"], moved):
            whole = begin.copy()
            whole[which] = moved
            latest.update(at=moved.copy(), whole=whole, states=problem.follow(whole))
        return latest["whole"], latest["states"]

    # Weight of a time constant that is to be kept, in standard deviations of its logarithm.
    hold = 1e3

    def residual(moved: Array) -> Array:
        whole, states = at(moved)
        parts = [rows * (problem.predict(whole, states) - problem.measured), prior * whole[slots]]
        if slow is not None:
            parts.append(np.array([hold * problem.slow_gap(whole, *slow)]))
        return np.concatenate(parts)

    def slope(moved: Array) -> Array:
        whole, states = at(moved)
        around = np.zeros((len(slots), problem.size))
        around[np.arange(len(slots)), slots] = prior
        parts = [rows[:, None] * problem.sensitivities(whole, states), around]
        if slow is not None:
            steps = 1e-6 * np.eye(problem.size)
            gaps = [problem.slow_gap(whole + d, *slow) - problem.slow_gap(whole - d, *slow) for d in steps]
            parts.append(hold * np.array(gaps)[None, :] / 2e-6)
        return np.concatenate(parts)[:, which]

    result = least_squares(
        residual, begin[which], slope, bounds=(lower[which], upper[which]), x_scale="jac", xtol=1e-10, max_nfev=60
    )
    whole, _ = at(result.x)
    return problem.solution_at(
        whole, rows, prior, success=bool(result.success), status=str(result.message), iterations=int(result.nfev)
    )
