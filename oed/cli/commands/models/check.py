"""Checks logs before anything is fitted to them: units, clocks, signs, outliers, the meaning of the torque.

Writes nothing. The exit code is 0 if all logs are usable, 1 if one is not, 2 if one cannot be read.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from oed.cli.options.logs import KnownLogs
from oed.cli.options.robots import RobotOptions
from oed.cli.verbs import Printed, Verb
from robots.common.options import Option
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Check(Verb):
    """``oed check``.

    Attributes:
        logs: logs, or folders of logs.
    """

    function = "estimation.check_log"
    examples = ("oed check log.csv --robot er3a", "oed check logs --robot arm.urdf --torque-is current --json")

    logs: Annotated[tuple[Path, ...], Option(argument=True, shown="LOG...")]
    robot: RobotOptions
    known: KnownLogs = KnownLogs()

    def run(self, progress: Progress) -> Printed:
        """Checks the logs."""
        from estimation import check_log

        described = self.robot.load()
        progress.start("checking the logs", None)
        described, logs = self.known.read_known(self.logs, described, torque=False)
        reports = [check_log(described, log) for log in logs]
        refused = any(report.refused for report in reports)
        return Printed(
            summary="\n".join(report.summary() for report in reports),
            data={"usable": not refused, "logs": [report.to_dict() for report in reports]},
            code=1 if refused else 0,
        )
