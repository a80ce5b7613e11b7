"""The verdict, from what the comparison with free functions and the held-out data left of the findings."""

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


class Reason(Enum):
    """Why the verdict is what it is."""

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
        reason: why.
    """

    verdict: str
    reason: Reason


def decide(
    *, causes: int, close_rivals: bool, free_functions: int, rejected_free_functions: int, rejected_causes: int
) -> Decision:
    """Decides the verdict; nothing else does.

    Args:
        causes: named effects in the model, measured gear compliances included.
        close_rivals: whether another cause fits about as well as one of them.
        free_functions: functions without a name in the model.
        rejected_free_functions: significant ones that held-out data rejected.
        rejected_causes: significant effects that held-out data rejected and nothing replaced.
    """
    if free_functions:
        return Decision("unexplained", Reason.FREE_FUNCTION)
    if rejected_free_functions:
        return Decision("unexplained", Reason.REJECTED_FREE_FUNCTION)
    if causes:
        return Decision("ambiguous", Reason.CLOSE_RIVALS) if close_rivals else Decision("named", Reason.CAUSES_FOUND)
    if rejected_causes:
        return Decision("unexplained", Reason.REJECTED_CAUSES)
    return Decision("none", Reason.NOTHING_SIGNIFICANT)
