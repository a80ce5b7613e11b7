"""Findings after the validation on held-out data, its changes, and the verdict."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from estimation.diagnosis.findings import Gain
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.searches.selection import SelectedEffect
from estimation.diagnosis.validations.gear_compliance import MeasuredCompliance
from estimation.diagnosis.validations.held_out_errors import HeldOutResult
from estimation.diagnosis.validations.name_comparison import has_close_rivals


class Change(Enum):
    """Kinds of changes that the validation on held-out data makes to findings.

    Attributes:
        INSIGNIFICANT: rejected, because it was barely significant and the held-out data do not support it.
        REJECTED: a significant effect was rejected, because it does not improve the held-out prediction.
        REPLACED: replaced by a rival that the held-out data support.
        ABSENT: kept, but absent from the held-out data, such as a payload that was removed before.
        FREE_FUNCTION_REJECTED: a free function was rejected; its residual is still significant.
    """

    INSIGNIFICANT = "insignificant"
    REJECTED = "rejected"
    REPLACED = "replaced"
    ABSENT = "absent"
    FREE_FUNCTION_REJECTED = "free function rejected"


@dataclass(frozen=True)
class ChangedFinding:
    """One change of a finding.

    Attributes:
        change: kind of change.
        effect: effect and joint before the change.
        instead: effect and joint that replaced it; None without a replacement.
    """

    change: Change
    effect: Hypothesis
    instead: Hypothesis | None = None


@dataclass(frozen=True, eq=False)
class ValidatedFindings:
    """Findings after validation.

    Attributes:
        findings: accepted named effects.
        effects: fits of the named effects, followed by free functions.
        p_values: p-values of `effects`.
        measured: held-out results of `effects`.
        rejected_discrepancies: free functions rejected by held-out data, with p-value and gain.
        changes: rejected and replaced effects.
        refuted: significant named effects that held-out data contradict, with p-value and gain. The residual they
            explained is still significant.
        compliances: measured compliances of gears with link encoders.
    """

    findings: tuple[SelectedEffect, ...]
    effects: tuple[FittedEffect, ...]
    p_values: tuple[float, ...]
    measured: HeldOutResult
    rejected_discrepancies: tuple[tuple[FittedEffect, float, Gain], ...]
    changes: tuple[ChangedFinding, ...]
    refuted: tuple[tuple[FittedEffect, float, Gain], ...]
    compliances: tuple[MeasuredCompliance, ...] = ()


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
