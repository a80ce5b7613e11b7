"""Shapes in which a rival would imitate a cause best: after the next experiment it is fitted anew."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.experiment_plans.experiment_grams import Cause, Grams
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem

Array = NDArray[np.float64]

# What is tried around a fitted shape: factors of a logarithmic parameter, shares of the range of another.
FACTORS, SHARES = (0.5, 0.7, 1.4, 2.0), (-0.25, -0.1, 0.1, 0.25)
# And so many points of the scan's grid.
POINTS = 16


@dataclass(frozen=True, eq=False)
class RivalShape:
    """A cause with another shape than the one that was fitted."""

    hypothesis: Hypothesis
    shape: tuple[float, ...]
    coefficients: Array


def find_rival_shapes(problem: Problem, causes: Sequence[Cause]) -> list[tuple[int, RivalShape]]:
    """Finds for each cause the forms of the others that leave the least of it on the logs there are.

    Returns:
        Index and form of the causes that imitate another better so than as they were fitted.
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
        # A moment of the logs says nothing of an experiment.
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
