"""What the run of a campaign recorded."""

from __future__ import annotations

from dataclasses import dataclass

from oed.campaigns.runs.state import RecordedStage
from robots.common.records import Record


@dataclass(frozen=True, kw_only=True)
class CampaignRun(Record):
    """A campaign that was played to its end.

    Attributes:
        robot: its name.
        place: the controller.
        folder: of the logs.
        stages: all stages in the order of the timetable.
        starts: how often the run was started; each start after the first followed an interruption.
        duration: from the beginning of this start [s].
    """

    ENTRIES = ("*", "rows")

    robot: str
    place: str
    folder: str
    stages: tuple[RecordedStage, ...]
    starts: int
    duration: float

    @property
    def rows(self) -> int:
        """Rows of all logs."""
        return sum(stage.rows for stage in self.stages)

    def summary(self) -> str:
        """Says in a few lines what was recorded."""
        lost = [stage.lost for stage in self.stages]
        known = [count for count in lost if count is not None]
        loss = f"{sum(known)} lost" if known else "loss unknown: the feedback carries no time"
        lines = [
            f"{len(self.stages)} stages of {self.robot} recorded at {self.place}: {self.rows} rows, {loss}",
            f"logs in {self.folder}",
        ]
        if self.starts > 1:
            lines.insert(1, f"interrupted {self.starts - 1} times, each stage recorded once")
        return "\n".join(lines)
