"""Free functions of the motion, time and load: what they explain beside names, or in place of them."""

from __future__ import annotations

from collections.abc import Sequence

from estimation.diagnosis.calibration import FREE_P_VALUE, MAX_FREE_FUNCTIONS, MIN_BIC_GAIN, MIN_FREE_SHARE
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import FittedEffect, refine
from estimation.diagnosis.hypothesis_tests.scan import Entry, scan
from estimation.diagnosis.hypothesis_tests.scoring import accept

# A grid tells narrow functions of few parameters less well than wide ones of many: so many are refined and compared.
CONTENDERS = 3


def free_functions(
    problem: Problem,
    patterns: Sequence[Entry],
    named: Sequence[FittedEffect],
    false_alarm: float,
    *,
    alone: bool = False,
) -> tuple[list[FittedEffect], list[float]]:
    """Adds patterns beside named effects, while the strongest is significant and worth it.

    Where the first is `alone`, no formula beside it that could be inexact, it must be no more than sure.
    """
    members: list[FittedEffect] = []
    p_values: list[float] = []
    while len(members) < MAX_FREE_FUNCTIONS:
        accepted = accept(problem, tuple(m.group for m in (*named, *members)))
        result = scan(problem, patterns, accepted)
        if not result.outcomes:
            break
        p = result.p_value(result.outcomes[0])
        if not p <= false_alarm:
            break
        near = [refine(problem, o.hypothesis, o.shape, accepted) for o in result.outcomes[:CONTENDERS] if o.degrees]
        member = max(near, key=lambda m: m.bic_gain)
        before = (*named, *members)
        if member.excess_chi2 < MIN_FREE_SHARE * sum(m.gain_on(member.group.joints) for m in before):
            break
        if member.bic_gain < MIN_BIC_GAIN and (before or not alone or p > FREE_P_VALUE):
            break
        members.append(member)
        p_values.append(p)
    return members, p_values


def strongest_pattern(
    problem: Problem,
    patterns: Sequence[Entry],
    named: Sequence[FittedEffect],
    false_alarm: float,
) -> tuple[FittedEffect, float] | None:
    """Gives the free function that explains most beside names, and its p-value; None where noise explains as much."""
    members, p_values = free_functions(problem, patterns, named, false_alarm, alone=True)
    return (members[0], p_values[0]) if members else None
