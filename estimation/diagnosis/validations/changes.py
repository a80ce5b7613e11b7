"""What held-out data changed in the findings."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis


class Change(Enum):
    """What held-out data changed in the findings."""

    INSIGNIFICANT = "insignificant"
    REJECTED = "rejected"
    REPLACED = "replaced"
    ABSENT = "absent"
    FREE_FUNCTION_REJECTED = "free function rejected"


@dataclass(frozen=True)
class ChangedFinding:
    """One change.

    Attributes:
        change: its kind.
        effect: the effect as it was found.
        instead: what replaced it; None for nothing.
    """

    change: Change
    effect: Hypothesis
    instead: Hypothesis | None = None
