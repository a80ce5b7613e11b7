"""What a check can ask about a log: the log at each stage, and the findings so far."""

from __future__ import annotations

from collections.abc import Iterable
from enum import IntEnum
from functools import cached_property

from estimation.gate.finding import Finding
from estimation.gate.quick_fits.cutoff_choice import Smoothed
from estimation.gate.quick_fits.fitted import Fitted
from estimation.gate.quick_fits.reading import Reading
from estimation.recordings.rows.one_log import Recorded
from estimation.recordings.rows.row_flags import Cleaned
from robots.robot import Robot
from robots.signals import Log

# Causes for which a log is refused: what other checks would find behind them follows from them.
CAUSES = (
    "motor_side_position",
    "other_robot",
    "row_counter",
    "short",
    "static_poses",
    "unit_of_position",
    "unit_of_time",
    "wrapped_angle",
)


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
        reading: of the log, with which it fits best; None before this is decided, and as logged.
    """

    def __init__(self, robot: Robot, log: Log) -> None:
        self.robot = robot
        self.recorded = Recorded(robot, log)
        self.cleaned = Cleaned(self.recorded)
        self.findings: list[Finding] = []
        self.reading: Reading | None = None

    @cached_property
    def smoothed(self) -> Smoothed:
        """Smoothed excerpts of the cleaned log.

        Raises:
            RuntimeError: the log does not reach this stage.
        """
        if not self.cleaned.can_be_smoothed:
            raise RuntimeError("the log does not reach the stage SMOOTHED: see Check.stage")
        return Smoothed(self.cleaned)

    @cached_property
    def logged(self) -> Fitted:
        """Quick fits to these excerpts, as they were logged.

        Raises:
            RuntimeError: the log does not reach this stage.
        """
        if not self.can_be_fitted:
            raise RuntimeError("the log does not reach the stage FITTED: see Check.stage")
        choice = self.smoothed.choice
        assert choice.rows is not None
        assert choice.sharp is not None
        return Fitted(self.cleaned, self.smoothed, choice.rows, choice.sharp)

    @property
    def fitted(self) -> Fitted:
        """Quick fits to these excerpts, as they are read: what another reading explains is no fault of its own.

        Raises:
            RuntimeError: the log does not reach this stage.
        """
        return self.logged if self.reading is None else self._read

    @cached_property
    def _read(self) -> Fitted:
        assert self.reading is not None
        return self.logged.read_as(self.reading)

    @property
    def can_be_fitted(self) -> bool:
        """Whether the log has torques, enough rows, and possible values."""
        return self.cleaned.can_be_smoothed and self.smoothed.rows is not None

    def reaches(self, stage: Stage) -> bool:
        """Whether the log is good enough for the checks of a stage, and not refused for a cause that spoils it."""
        if stage == Stage.RECORDED:
            return True
        if any(finding.severity == "refuse" for finding in self.found(CAUSES)):
            return False
        return stage == Stage.CLEANED or (self.can_be_fitted if stage == Stage.FITTED else self.cleaned.can_be_smoothed)

    def found(self, names: Iterable[str]) -> list[Finding]:
        """Gives the findings so far that have one of these names."""
        chosen = frozenset(names)
        return [finding for finding in self.findings if finding.name in chosen]
