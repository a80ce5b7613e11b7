"""Free functions of motion, time and load: their gain beside named effects, or in place of them."""

from __future__ import annotations

from collections.abc import Sequence

from estimation.diagnosis.calibration import FREE_P_VALUE, MAX_FREE_FUNCTIONS, MIN_BIC_GAIN, MIN_FREE_SHARE
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine
from estimation.diagnosis.hypothesis_tests.scan import Entry, scan
from estimation.diagnosis.hypothesis_tests.scoring import accept

# Number of candidates that are refined. The scan on a grid underrates narrow functions with few parameters.
CONTENDERS = 3


def free_functions(
    problem: Problem,
    patterns: Sequence[Entry],
    named: Sequence[FittedEffect],
    false_alarm: float,
    *,
    alone: bool = False,
) -> tuple[list[FittedEffect], list[float]]:
    """Adds free functions beside named effects, as long as the strongest is significant and improves the BIC.

    A free function must also explain a minimum share of what the other effects explain on its joints.

    Args:
        problem: whitened data.
        patterns: candidate free functions, measured.
        named: named effects in the model.
        false_alarm: largest p-value of a free function.
        alone: whether a very small p-value suffices for the first free function if no named effect is in the model.

    Returns:
        The free functions in the order of their selection, and the p-value of each.
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
