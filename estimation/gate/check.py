"""What a check of a log is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import ClassVar

from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding


class Check(ABC):
    """One check of a log before it is fitted.

    Attributes:
        name: of the check, unique.
        stage: from which it runs; a log that does not reach it is not checked.
        order: place among the checks of the same stage. Findings of equal severity are printed in the order of their
            checks.
    """

    name: ClassVar[str]
    stage: ClassVar[Stage] = Stage.RECORDED
    order: ClassVar[int] = 1000

    @abstractmethod
    def run(self, context: Context) -> Sequence[Finding]:
        """Looks for faults.

        Args:
            context: the log at the check's stage and at those before, and the findings of the checks before.

        Returns:
            The findings; none if the log has no such fault.
        """


Question = Callable[[Context], Sequence[Finding]]
"""A question to a log at some stage; its answers are findings."""


def asked(question: Question, stage: Stage, order: int) -> type[Check]:
    """Gives the check that asks one question, under the name of its function.

    Args:
        question: a function.
        stage: from which it is asked.
        order: place among the questions of its stage.
    """

    def run(self: Check, context: Context) -> Sequence[Finding]:
        return question(context)

    name = question.__name__
    return type(name, (Check,), {"name": name, "stage": stage, "order": order, "run": run, "__doc__": question.__doc__})
