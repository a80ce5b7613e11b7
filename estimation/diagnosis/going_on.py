"""Whether an effect of a moment goes on beside what its formula has of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimation.diagnosis.problem import Problem
from estimation.diagnosis.refinement import Member, refine
from estimation.diagnosis.scoring import accept
from estimation.diagnosis.worthwhile import LEAST


def going_on(problem: Problem, member: Member, others: Sequence[Member], errors: Sequence[float]) -> list[float]:
    """Makes errors of shape parameters infinite where the data say that the effect goes on beyond them.

    A push on an elbow while the arm moves is no pulse of constant torques: such a pulse is told where it is largest,
    and its edges, however sharp they are, are not the push's.

    Args:
        problem: the data.
        member: whose shapes have the errors.
        others: what else was found.
        errors: by the profiles.
    """
    result, further = list(errors), member.hypothesis.effect.further(member.shape)
    if further:
        beside = accept(problem, tuple(m.group for m in (member, *others)))
        for k, shape in further:
            if refine(problem, member.hypothesis, shape, beside, effort=0).worth(problem.rows) > LEAST:
                result[k] = np.inf
    return result
