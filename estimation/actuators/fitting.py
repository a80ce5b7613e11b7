"""Output-error fit: Gauss-Newton on the simulated motion, with exact derivatives and bounds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from estimation.actuators.freedom import Freedom
from estimation.actuators.options import FitOptions
from estimation.actuators.runs import Run
from estimation.actuators.simulated_error import Errors, linearised_runs, rms, simulate_runs
from estimation.uncertainty.correlations import correlation_rows
from robots.common.arrays import Array
from robots.common.errors import SolverError
from robots.common.progress import SILENT, Progress

PRIOR = 100.0
"""Standard deviation of a free parameter about its start, in its sizes: what the motion does not show stays there."""
FIRST, GROWTH, SHRINKAGE, MOST = 1e-3, 6.0, 0.2, 1e6
"""Damping of the first step, its factors after a step that fails or succeeds, and the largest."""
FINE, POLISHED = 2, 6
"""Steps of the finer simulation in usual ones, and the most steps of the fit with it."""
SHARE = 0.1
"""Decrease of the cost, in what a parameter takes off noise, at which the finer fit ends."""
FLOOR = 1e-5
"""Least error of a joint [rad or m] in its weight: encoders are no better."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """A fitted set of parameters.

    Attributes:
        freedom: what was free.
        values: all parameters, chain by chain.
        theta: the free ones, scaled (K,).
        errors: of the simulated motion, with derivatives.
        weights: of the joints (n,) [1/rad2 or 1/m2]; with currents, then of these (2 n,).
        cost: the weighted sum of squares.
        settled: whether the last steps changed nothing.
        start: the scaled values that the prior is about (K,).
        options: settings.
    """

    freedom: Freedom
    values: tuple[Array, ...]
    theta: Array
    errors: tuple[Errors, ...]
    weights: Array
    cost: float
    settled: bool
    start: Array
    options: FitOptions = field(default_factory=FitOptions)

    @property
    def at_bound(self) -> NDArray[np.bool_]:
        """Which free parameters are at a bound (K,)."""
        lower, upper = self.freedom.bounds
        width = 1e-6 * np.maximum(1.0, np.abs(self.theta))
        return np.asarray((self.theta <= lower + width) | (self.theta >= upper - width))

    @property
    def rms(self) -> Array:
        """Error of each joint (n,) [rad or m]."""
        return rms(self.errors)


def fit_drives(
    freedom: Freedom,
    start: Sequence[Array],
    runs: Sequence[Run],
    options: FitOptions | None = None,
    progress: Progress = SILENT,
    weights: Array | None = None,
) -> Fit:
    """Fits the free parameters to the measured motion.

    Args:
        freedom: what is free.
        start: values to start from, chain by chain.
        runs: what was recorded.
        options: settings.
        progress: receives each step.
        weights: of the joints (n,) [1/rad2 or 1/m2], and of currents, in the first round; by default alike.

    Raises:
        SolverError: the loop is not stable at the start.
    """
    chosen = options or FitOptions()
    theta = freedom.theta(start)
    prior = theta.copy()
    errors = linearised_runs(freedom, freedom.values(theta, start), runs)
    if weights is None:
        kinds = np.split(np.maximum(rms(errors), FLOOR) ** 2, range(freedom.fleet.n, len(rms(errors)), freedom.fleet.n))
        weights = np.concatenate([np.full(freedom.fleet.n, float(np.mean(kind)) ** -1) for kind in kinds])
    settled = False
    for round_ in range(chosen.rounds):
        theta, errors, settled = _descend(freedom, start, theta, prior, errors, weights, runs, chosen, progress)
        if round_ + 1 < chosen.rounds:
            weights = np.maximum(rms(errors), FLOOR) ** -2
    return Fit(
        freedom=freedom,
        values=freedom.values(theta, start),
        theta=theta,
        errors=tuple(errors),
        weights=weights,
        cost=_cost(errors, weights, theta - prior),
        settled=settled,
        start=prior,
        options=chosen,
    )


def polished(fit: Fit, progress: Progress = SILENT) -> Fit:
    """Continues a fit with a finer simulation, until a step brings little beside what noise makes of the cost.

    Args:
        fit: that has settled.
        progress: receives each step.
    """
    freedom, runs = fit.freedom, [part.run for part in fit.errors]
    errors = linearised_runs(freedom, fit.values, runs, refinement=FINE)
    memory = max(correlation_rows(column) for part in errors for column in part.error.T)
    rows = sum(int(part.run.counted.sum()) for part in errors) * freedom.fleet.n
    enough = replace(fit.options, iterations=POLISHED, settled=SHARE * memory / rows)
    theta, errors, _ = _descend(
        freedom, fit.values, fit.theta, fit.start, errors, fit.weights, runs, enough, progress, FINE
    )
    values, cost = freedom.values(theta, fit.values), _cost(errors, fit.weights, theta - fit.start)
    return replace(fit, values=values, theta=theta, errors=tuple(errors), cost=cost)


def normal_equations(errors: Sequence[Errors], weights: Array) -> tuple[Array, Array]:
    """Sums the weighted Gram matrix (K, K) and the gradient (K,) of the scaled free parameters."""
    gram: Array | None = None
    right: Array | None = None
    for part in errors:
        assert part.jacobian is not None
        size = part.jacobian.shape[2]
        J = (part.jacobian * np.sqrt(weights)[:, None]).reshape(-1, size)
        e = (part.error * np.sqrt(weights)).reshape(-1)
        gram = J.T @ J if gram is None else gram + J.T @ J
        right = J.T @ e if right is None else right + J.T @ e
    assert gram is not None
    assert right is not None
    return gram, right


def _descend(
    freedom: Freedom,
    fixed: Sequence[Array],
    theta: Array,
    prior: Array,
    errors: list[Errors],
    weights: Array,
    runs: Sequence[Run],
    options: FitOptions,
    progress: Progress,
    refinement: int = 1,
) -> tuple[Array, list[Errors], bool]:
    lower, upper = freedom.bounds
    damping, cost = FIRST, _cost(errors, weights, theta - prior)
    for _ in range(options.iterations):
        gram, right = normal_equations(errors, weights)
        gram[np.diag_indices(len(theta))] += PRIOR**-2
        right = right - (theta - prior) / PRIOR**2
        before, reached = cost, list[Errors]()
        # The first step mostly succeeds, and derivatives are wanted there; others are simulated alone first.
        evaluate = partial(linearised_runs, freedom, refinement=refinement)
        while damping < MOST:
            trial = theta + _step(gram, right, damping, lower - theta, upper - theta)
            try:
                reached = evaluate(freedom.values(trial, fixed), runs)
                found = _cost(reached, weights, trial - prior)
            except SolverError:
                found = np.inf
            if found < cost:
                theta, cost, damping = trial, found, max(damping * SHRINKAGE, 1e-9)
                break
            damping *= GROWTH
            evaluate = partial(simulate_runs, freedom.fleet, refinement=refinement)
        if cost >= before:
            return theta, errors, True
        if reached[0].jacobian is None:
            reached = linearised_runs(freedom, freedom.values(theta, fixed), runs, refinement=refinement)
        errors = reached
        progress.update(0.0, f"simulated error {1e3 * float(np.mean(rms(errors))):.3g} mrad")
        if before - cost < options.settled * before:
            return theta, errors, True
    return theta, errors, False


def _step(gram: Array, right: Array, damping: float, lower: Array, upper: Array) -> Array:
    """Minimises the damped quadratic within bounds."""
    scale = np.sqrt(np.diag(gram))
    damped = gram / scale[:, None] / scale + damping * np.eye(len(gram))
    root = np.linalg.cholesky(damped).T
    target = np.linalg.solve(root.T, right / scale)
    free = np.linalg.solve(root, target) / scale
    if (free >= lower).all() and (free <= upper).all():
        return np.asarray(free)
    slack = 1e-12
    found = lsq_linear(root, target, ((lower - slack) * scale, (upper + slack) * scale), method="bvls")
    return np.asarray(np.clip(found.x / scale, lower, upper))


def _cost(errors: Sequence[Errors], weights: Array, moved: Array) -> float:
    data = sum(float((part.error**2 * weights).sum()) for part in errors)
    return data + float((moved**2).sum()) / PRIOR**2
