"""How short the slow time constant may be: a bound by the profile of the likelihood."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimation.thermal.transcriptions.solve import solve
from estimation.thermal.transcriptions.transcription import Solution, Transcription
from estimation.uncertainty.quantiles import normal_quantile

Array = NDArray[np.float64]

# Fall of the log likelihood at a one-sided 95 % bound.
FALL = normal_quantile(0.95) ** 2 / 2
# Bisections of the logarithm: the bound is found to 2 %.
STEPS = 7
# Where the rest is at its bounds, IPOPT goes on for ever about a cost that it has long found.
ITERATIONS = 400


def slow_bound(
    problem: Transcription,
    solution: Solution,
    free: NDArray[np.bool_],
    weights: Array,
    prior: Array,
    power: float,
    estimate: float,
    colour: float,
) -> float:
    """Finds the least slow time constant at which the rest of the model can still explain the data.

    Args:
        problem: the runs.
        solution: of the fit.
        free: which coordinates may move.
        weights: of the measurements.
        prior: of the surroundings.
        power: at which the time constant holds [W].
        estimate: the fit's time constant [s].
        colour: ratio of the standard errors to those of white noise.

    Returns:
        The bound [s].
    """
    allowed = solution.cost + FALL * colour**2
    high, low = float(np.log(estimate)), float(np.log(estimate / 100.0))
    current = solution.coordinates

    def kept(constant: float) -> Solution:
        return solve(
            problem, current, free, weights, prior, slow=(power, float(np.exp(constant))), max_iterations=ITERATIONS
        )

    for _ in range(STEPS):
        middle = (low + high) / 2.0
        tried = kept(middle)
        close = abs(problem.slow_gap(tried.coordinates, power, float(np.exp(middle)))) < 1e-3
        if close and tried.cost <= allowed:
            high, current = middle, tried.coordinates
        else:
            low = middle
    return float(np.exp(high))
