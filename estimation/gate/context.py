"""What a check can ask about a log: the log at each stage, and the findings so far."""

from __future__ import annotations

from collections.abc import Iterable
from enum import IntEnum
from functools import cached_property

from estimation.gate.finding import Finding
from estimation.gate.stages.cleaned import Cleaned
from estimation.gate.stages.fitted import Fitted
from estimation.gate.stages.recorded import Recorded
from estimation.gate.stages.smoothed import Smoothed
from robots.robot import Robot
from robots.signals import Log


class Stage(IntEnum):
    """How far a log is prepared when a check runs.

    Attributes:
        RECORDED: all rows, with corrected times.
        CLEANED: without outliers, copies and rows without a known time.
        SMOOTHED: excerpts with velocities and accelerations. Too short logs and impossible values end before it.
        FITTED: quick fits of rigid body and friction. Logs without torque end before it.
    """

    RECORDED = 0
    CLEANED = 1
    SMOOTHED = 2
    FITTED = 3


class Context:
    """A log under check.

    Attributes:
        robot: with n joints, on the log's base and with its payload.
        recorded: the log with all its rows.
        cleaned: the log without the rows that a fit leaves out.
        findings: of the checks so far, in their order.
        explained: joints, from 1, that fit badly as logged, but not under the likeliest other meaning of the log.
    """

    def __init__(self, robot: Robot, log: Log) -> None:
        self.robot = robot
        self.recorded = Recorded(robot, log)
        self.cleaned = Cleaned(self.recorded)
        self.findings: list[Finding] = []
        self.explained: frozenset[int] = frozenset()

    @cached_property
    def smoothed(self) -> Smoothed:
        """Smoothed excerpts of the cleaned log.

        Raises:
            RuntimeError: the log does not reach this stage.
        """
        self._require(Stage.SMOOTHED)
        return Smoothed(self.cleaned)

    @cached_property
    def fitted(self) -> Fitted:
        """Quick fits to these excerpts.

        Raises:
            RuntimeError: the log does not reach this stage.
        """
        self._require(Stage.FITTED)
        rows = self.smoothed.rows
        assert rows is not None
        return Fitted(self.cleaned, self.smoothed, rows)

    def reaches(self, stage: Stage) -> bool:
        """Whether the log is good enough for the checks of a stage."""
        if stage <= Stage.CLEANED:
            return True
        return self.cleaned.can_be_smoothed and (stage < Stage.FITTED or self.smoothed.rows is not None)

    def found(self, names: Iterable[str]) -> list[Finding]:
        """Gives the findings so far that have one of these names."""
        chosen = frozenset(names)
        return [finding for finding in self.findings if finding.name in chosen]

    def _require(self, stage: Stage) -> None:
        if not self.reaches(stage):
            raise RuntimeError(f"the log does not reach the stage {stage.name}: see Check.stage")
