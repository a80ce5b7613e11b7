"""Agreement of the joints on a coefficient that they share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.calibration import OTHER_FORMULA_ERROR, SHARED_FORMULA_ERROR
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.scoring import Accepted, score
from robots.common.arrays import Array


@dataclass(frozen=True, eq=False)
class PerJointEvidence:
    """Separate estimates of a shared coefficient on the m joints where an effect with one column acts.

    Attributes:
        gram: squared norm of the column on each joint (m,).
        cross: its product with the residual (m,).
        certain_share: share of this information (m,) that remains with errors of the motion.
        formula_variance: variance of each estimate (m,) due to formula errors of other effects on that joint.
    """

    gram: Array
    cross: Array
    certain_share: Array
    formula_variance: Array

    def subset(self, joints: NDArray[np.bool_]) -> PerJointEvidence:
        """Selects some of the joints by a mask (m,)."""
        return PerJointEvidence(
            self.gram[joints], self.cross[joints], self.certain_share[joints], self.formula_variance[joints]
        )

    def gain(self, *, surely: bool = False) -> float:
        """Returns the chi-square of one coefficient for all joints, divided by their Birge ratio.

        Args:
            surely: whether to reduce it to the share that errors of the motion leave.
        """
        share = self.certain_share if surely else 1.0
        return shared_coefficient_gain(share * self.gram, share * self.cross, self.formula_variance)


def per_joint_evidence(
    problem: Problem, hypothesis: Hypothesis, shape: tuple[float, ...], accepted: Accepted
) -> PerJointEvidence:
    """Fits a delay (an effect with one column, torque per time) on each of its joints separately.

    Most information on a delay is at reversals. Their times have errors from the velocity, which are alike at each
    reversal and do not average out. `certain_share` allows for that.

    Args:
        problem: data and base model.
        hypothesis: effect and joint.
        shape: values of its shape parameters.
        accepted: groups already in the model.
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
            # The impulse balance already includes this error.
            timed = 0.0 if group.reversal_columns is None else float(np.sum(group.reversal_columns**2))
            if energies.sum() > 0:
                # Mean square time error, weighted by the column's energy in each row.
                squares = np.where(late > 0, group.columns[0][:, 0], 0.0) ** 2
                usual = np.sum(squares * late**2) / max(float(np.sum(squares)), 1e-300)
                sure[k] = (energies[0] / (1.0 + usual * energies[0]) + energies[1] + timed) / (energies.sum() + timed)
    apart = OTHER_FORMULA_ERROR**2 * explained[list(joints)] / np.where(gram > 0, gram, np.inf)
    return PerJointEvidence(gram, cross, sure, apart)


def shared_coefficient_gain(gram: Array, cross: Array, apart: Array | None = None) -> float:
    """Returns the chi-square that one coefficient of all joints explains, divided by their Birge ratio.

    One of three or more joints may disagree with the rest because of another error; it is then left out. The largest
    value over these choices counts.

    Args:
        gram: squared norm of each joint's column (m,), m at least 1, noise of unit variance.
        cross: product of each column with the residual (m,).
        apart: variance (m,) of each joint's coefficient due to formula errors of other effects; none by default.
    """
    if len(gram) == 1:
        return float(cross[0] ** 2 / gram[0])
    everyone = np.ones((1, len(gram)), dtype=bool)
    sets = np.vstack([everyone, ~np.eye(len(gram), dtype=bool)]) if len(gram) > 2 else everyone
    # The formulas may also be exact, so both variances are tried.
    errors = [np.zeros(len(gram)), *([] if apart is None else [apart])]
    return max(_over_scatter(gram[chosen], cross[chosen], own[chosen]) for chosen in sets for own in errors)


def _over_scatter(gram: Array, cross: Array, apart: Array) -> float:
    own, variance = cross / gram, 1.0 / gram + apart
    mean = np.sum(own / variance) / np.sum(1.0 / variance)
    squares = np.sum((own - mean) ** 2 / (variance + (SHARED_FORMULA_ERROR * mean) ** 2))
    explained = mean * (2.0 * cross.sum() - mean * gram.sum())
    return max(float(explained / max(1.0, squares / (len(gram) - 1))), 1e-300)
