"""Whether joints agree on a coefficient that all have alike, and how much what each says counts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.hypotheses import Hypothesis
from estimation.diagnosis.problem import Problem
from estimation.diagnosis.scoring import Accepted, score

Array = NDArray[np.float64]

# Share of a coefficient that all joints have alike by which each may differ: so far its formula is true.
ROUGH = 0.25


def joint_by_joint(
    problem: Problem, hypothesis: Hypothesis, shape: tuple[float, ...], accepted: Accepted
) -> tuple[Array, Array, Array]:
    """Measures an effect of one column, a torque per time, on each of its joints, beside others.

    A log with reversals tells a delay by them, as often as they come; but when a joint turns round is known only as
    well as its velocity is there, and kicks make that late at each of them alike.

    Returns:
        Squares of the column (m,), its products with the residual, and the share of what they tell that is sure.
    """
    joints, columns = problem.columns_of(hypothesis, shape)
    gram, cross, sure = np.zeros(len(joints)), np.zeros(len(joints)), np.ones(len(joints))
    for k, (j, X) in enumerate(zip(joints, columns, strict=True)):
        group = problem.group((j,), (X,), effect=hypothesis.effect)
        own = score(problem, group, accepted)
        gram[k], cross[k] = float(np.ravel(own.gram)[0]), float(np.ravel(own.cross)[0])
        late, beside = problem.late(j)
        if late > 0 and gram[k] > 0:
            told = np.maximum(score(problem, problem.split(group, np.ones(1), beside), accepted).gram.sum(axis=1), 0.0)
            if told.sum() > 0:
                sure[k] = (told[0] / (1.0 + late**2 * told[0]) + told[1]) / told.sum()
    return gram, cross, sure


def agreed_gain(gram: Array, cross: Array) -> float:
    """What one coefficient of all joints explains, over their Birge ratio.

    One joint may be at odds with the rest, where something else is left on it: it then counts for nothing.

    Args:
        gram: squares of each joint's column (m,), one or more, of noise one.
        cross: each one's product with the residual (m,).
    """
    if len(gram) == 1:
        return float(cross[0] ** 2 / gram[0])
    everyone = np.ones((1, len(gram)), dtype=bool)
    sets = np.vstack([everyone, ~np.eye(len(gram), dtype=bool)]) if len(gram) > 2 else everyone
    return max(_over_scatter(gram[chosen], cross[chosen]) for chosen in sets)


def _over_scatter(gram: Array, cross: Array) -> float:
    mean = cross.sum() / gram.sum()
    squares = np.sum((cross / gram - mean) ** 2 / (1.0 / gram + (ROUGH * mean) ** 2))
    return max(float(cross.sum() ** 2 / gram.sum() / max(1.0, squares / (len(gram) - 1))), 1e-300)
