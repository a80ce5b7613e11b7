"""Shapes in which a rival resembles a cause most, since it is refitted after the next experiment."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.experiment_plans.experiment_grams import Cause, Grams
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem

Array = NDArray[np.float64]

# Shapes tried around a fitted one: factors for logarithmic parameters, shares of the range for others.
FACTORS, SHARES = (0.5, 0.7, 1.4, 2.0), (-0.25, -0.1, 0.1, 0.25)
# Approximate number of grid points that are tried as well.
POINTS = 16


@dataclass(frozen=True, eq=False)
class RivalShape:
    """A cause with another shape than the fitted one.

    Attributes:
        hypothesis: effect and joint.
        shape: its shape parameters.
        coefficients: zeros (k,); they are refitted.
    """

    hypothesis: Hypothesis
    shape: tuple[float, ...]
    coefficients: Array


def find_rival_shapes(problem: Problem, causes: Sequence[Cause]) -> list[tuple[int, RivalShape]]:
    """Finds for each pair of causes the shape of the rival that leaves the least of the true cause on the logs.

    Args:
        problem: the logs.
        causes: the possible causes with their fitted shapes.

    Returns:
        Index of the cause, and its other shape, where that resembles another cause more than the fitted shape does.
    """
    forms = [
        (k, RivalShape(cause.hypothesis, shape, np.zeros(len(cause.coefficients))))
        for k, cause in enumerate(causes)
        for shape in _shapes(problem, cause)
    ]
    if not forms:
        return []
    grams = Grams(problem, causes, forms)
    chosen = set()
    for true in range(len(causes)):
        for rival in set(range(len(causes))) - {true}:
            own = [k for k, owner in enumerate(grams.owners) if owner == rival]
            best = min(own, key=lambda k: grams.left(grams.old, true, k))
            if best >= len(causes):
                chosen.add(best)
    return [forms[k - len(causes)] for k in sorted(chosen)]


def _shapes(problem: Problem, cause: Cause) -> Iterator[tuple[float, ...]]:
    effect, joint = cause.hypothesis.effect, cause.hypothesis.joint
    state = problem.state_for(effect)
    seen = {cause.shape}
    for shape in (*_around(problem, cause), *_spread(effect.grid(state, joint))):
        # A change time in the logs has no meaning in a new experiment.
        kept = tuple(
            own if s.moment else value for s, own, value in zip(effect.shapes, cause.shape, shape, strict=True)
        )
        if kept not in seen:
            seen.add(kept)
            yield kept


def _around(problem: Problem, cause: Cause) -> Iterator[tuple[float, ...]]:
    effect = cause.hypothesis.effect
    bounds = effect.bounds(problem.state_for(effect), cause.hypothesis.joint)
    for k, ((low, high), shape, value) in enumerate(zip(bounds, effect.shapes, cause.shape, strict=True)):
        if not high > low or shape.choices or shape.is_left(value):
            continue
        near = [value * f for f in FACTORS]
        if shape.scale == "linear" and np.isfinite(high - low):
            near = [value + share * (high - low) for share in SHARES]
        for other in near:
            yield (*cause.shape[:k], float(np.clip(other, low, high)), *cause.shape[k + 1 :])


def _spread(grid: Sequence[tuple[float, ...]]) -> Sequence[tuple[float, ...]]:
    return grid[:: max(1, -(-len(grid) // POINTS))]
