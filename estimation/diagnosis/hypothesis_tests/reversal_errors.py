"""Chi-square of an effect that errors of a joint's reversal times could explain as well."""

from __future__ import annotations

import numpy as np

from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Group, Problem
from estimation.diagnosis.hypothesis_tests.scoring import Accepted, score
from robots.terms.effects import EFFECTS


def gain_from_reversal_errors(problem: Problem, joint: int, group: Group, gain: float, accepted: Accepted) -> float:
    """Returns the part of a gain that disappears if all reversals of a joint may be late by their time error.

    Friction that changes sign gradually over a short travel resembles such an error. The delay is fitted beside the
    effect, with the time error as its prior standard deviation.

    Args:
        problem: data and base model.
        joint: counted from 1.
        group: the effect's columns.
        gain: chi-square that they explain.
        accepted: groups already in the model.
    """
    late = problem.reversal_time_error(joint - 1)
    if not late.any():
        return 0.0
    usual = float(np.sqrt(np.mean(late[late > 0] ** 2)))
    shifted = problem.measured(Hypothesis(EFFECTS["current_lag"], joint), (usual,))
    torque = np.where(late > 0, shifted.columns[0][:, 0].astype(float), 0.0)
    moved = problem.white_group((joint - 1,), (torque[:, None],))
    own, other = score(problem, group, accepted), score(problem, moved, accepted)
    between = problem.product(group, moved) - own.onto.T @ other.onto
    allowed = other.gram + usual**-2.0
    gram = own.gram - between @ between.T / allowed
    cross = own.cross - (between * other.cross / allowed)[:, 0]
    # Directions that the time error explains completely contain no information.
    values, vectors = np.linalg.eigh(gram)
    determined = values > 1e-9 * max(float(np.trace(own.gram)), 1e-300)
    left = float(np.sum((vectors[:, determined].T @ cross) ** 2 / values[determined]))
    return max(gain - left, 0.0)
