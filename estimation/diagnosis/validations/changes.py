"""Changes of findings by the validation on held-out data."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis


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
