"""Verdict of the diagnosis, from the validated findings."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from estimation.diagnosis.validations.name_comparison import has_close_rivals
from estimation.diagnosis.validations.validated_findings import ValidatedFindings


class Reason(Enum):
    """Reason for a verdict."""

    NOTHING_SIGNIFICANT = "nothing significant"
    CAUSES_FOUND = "causes found"
    CLOSE_RIVALS = "close rivals"
    FREE_FUNCTION = "only a free function explains part of the residual"
    REJECTED_FREE_FUNCTION = "held-out data reject the free function of a significant residual"
    REJECTED_CAUSES = "held-out data reject all causes of a significant residual"


@dataclass(frozen=True)
class Decision:
    """A verdict and its reason.

    Attributes:
        verdict: ``none``, ``named``, ``ambiguous`` or ``unexplained``.
        reason: reason for the verdict.
    """

    verdict: str
    reason: Reason


def decide(validated: ValidatedFindings) -> Decision:
    """Decides the verdict. No other function sets or changes it.

    Args:
        validated: findings after the validation on held-out data.

    Returns:
        The verdict and its reason.
    """
    if len(validated.effects) > len(validated.findings):
        return Decision("unexplained", Reason.FREE_FUNCTION)
    if validated.rejected_discrepancies:
        return Decision("unexplained", Reason.REJECTED_FREE_FUNCTION)
    if validated.findings or validated.compliances:
        if any(map(has_close_rivals, validated.findings)):
            return Decision("ambiguous", Reason.CLOSE_RIVALS)
        return Decision("named", Reason.CAUSES_FOUND)
    if validated.refuted:
        return Decision("unexplained", Reason.REJECTED_CAUSES)
    return Decision("none", Reason.NOTHING_SIGNIFICANT)
