"""Findings after the validation on held-out data, and its changes."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from estimation.diagnosis.findings import Gain
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.searches.selection import SelectedEffect
from estimation.diagnosis.validations.gear_compliance import MeasuredCompliance
from estimation.diagnosis.validations.held_out_errors import HeldOutResult


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
