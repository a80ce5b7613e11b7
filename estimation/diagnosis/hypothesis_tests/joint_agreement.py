"""Whether joints agree on a coefficient that all have alike, and how much what each says counts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.calibration import OTHER_FORMULA_ERROR, SHARED_FORMULA_ERROR
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.scoring import Accepted, score

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PerJointEvidence:
    """What each of the joints on which an effect of one column acts tells of its coefficient.

    Attributes:
        gram: squares of the column (m,).
        cross: its products with the residual (m,).
        certain_share: share (m,) of what they tell that errors of the motion leave.
        formula_variance: variance (m,) of a joint's own coefficient that the formulas of other effects there may make.
    """

    gram: Array
    cross: Array
    certain_share: Array
    formula_variance: Array

    def subset(self, joints: NDArray[np.bool_]) -> PerJointEvidence:
        """Gives what some of the joints (m,) tell."""
        return PerJointEvidence(
            self.gram[joints], self.cross[joints], self.certain_share[joints], self.formula_variance[joints]
        )

    def gain(self, *, surely: bool = False) -> float:
        """What one coefficient of all joints explains, over their Birge ratio; of what is sure of that, where asked."""
        share = self.certain_share if surely else 1.0
        return shared_coefficient_gain(share * self.gram, share * self.cross, self.formula_variance)


def per_joint_evidence(
    problem: Problem, hypothesis: Hypothesis, shape: tuple[float, ...], accepted: Accepted
) -> PerJointEvidence:
    """Measures an effect of one column, a torque per time, on each of its joints, beside others.

    A log with reversals tells a delay by them, as often as they come; but when a joint turns round is known only as
    well as its velocity is there, and kicks make that late at each of them alike.
    """
    joints, columns = problem.columns_of(hypothesis, shape)
    gram, cross, sure = np.zeros(len(joints)), np.zeros(len(joints)), np.ones(len(joints))
    explained = np.sum(accepted.torque(problem.white) ** 2, axis=0)
    for k, (j, X) in enumerate(zip(joints, columns, strict=True)):
        group = problem.group((j,), (X,), effect=hypothesis.effect)
        own = score(problem, group, accepted)
        gram[k], cross[k] = float(np.ravel(own.gram)[0]), float(np.ravel(own.cross)[0])
        late = problem.reversal_time_error(j)
        if late.any() and gram[k] > 0:
            energies = score(problem, problem.split(group, np.ones(1), late > 0), accepted).gram.sum(axis=1)
            energies = np.maximum(energies, 0.0)
            # The evidence of the balance of impulses contains its error already.
            timed = 0.0 if group.reversal_columns is None else float(np.sum(group.reversal_columns**2))
            if energies.sum() > 0:
                # What each of them has of the column's squares weighs its moment.
                squares = np.where(late > 0, group.columns[0][:, 0], 0.0) ** 2
                usual = np.sum(squares * late**2) / max(float(np.sum(squares)), 1e-300)
                sure[k] = (energies[0] / (1.0 + usual * energies[0]) + energies[1] + timed) / (energies.sum() + timed)
    apart = OTHER_FORMULA_ERROR**2 * explained[list(joints)] / np.where(gram > 0, gram, np.inf)
    return PerJointEvidence(gram, cross, sure, apart)


def shared_coefficient_gain(gram: Array, cross: Array, apart: Array | None = None) -> float:
    """What one coefficient of all joints explains, over their Birge ratio.

    One joint may be at odds with the rest, where something else is left on it: it then counts for nothing.

    Args:
        gram: squares of each joint's column (m,), one or more, of noise one.
        cross: each one's product with the residual (m,).
        apart: variance (m,) by which a joint's own coefficient may be another for other effects' sake; none by default.
    """
    if len(gram) == 1:
        return float(cross[0] ** 2 / gram[0])
    everyone = np.ones((1, len(gram)), dtype=bool)
    sets = np.vstack([everyone, ~np.eye(len(gram), dtype=bool)]) if len(gram) > 2 else everyone
    # Formulas may be that exact, too: joints that agree need not differ.
    errors = [np.zeros(len(gram)), *([] if apart is None else [apart])]
    return max(_over_scatter(gram[chosen], cross[chosen], own[chosen]) for chosen in sets for own in errors)


def _over_scatter(gram: Array, cross: Array, apart: Array) -> float:
    own, variance = cross / gram, 1.0 / gram + apart
    mean = np.sum(own / variance) / np.sum(1.0 / variance)
    squares = np.sum((own - mean) ** 2 / (variance + (SHARED_FORMULA_ERROR * mean) ** 2))
    explained = mean * (2.0 * cross.sum() - mean * gram.sum())
    return max(float(explained / max(1.0, squares / (len(gram) - 1))), 1e-300)
