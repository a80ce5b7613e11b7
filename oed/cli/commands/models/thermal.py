"""Identifies parameters and the effect of temperature on friction.

Writes model.json and report.html.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from estimation.thermal.options import ThermalOptions
from oed.cli.options.logs import Columns
from oed.cli.options.results import Folder
from oed.cli.options.robots import RobotOptions
from oed.cli.verbs import Printed, Verb
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Thermal(Verb):
    """``oed thermal``.

    Attributes:
        log: a log, or a folder of logs. Repeatable. All logs share one clock; the robot rests between them.
    """

    function = "estimation.identify_thermal"
    examples = ("oed thermal --robot er3a --log logs --order auto --out thermal",)

    robot: RobotOptions
    log: tuple[Path, ...]
    columns: Columns = Columns()
    options: ThermalOptions = ThermalOptions()
    output: Folder = Folder(out=Path("thermal"))

    def run(self, progress: Progress) -> Printed:
        """Identifies robot and heat."""
        from estimation.thermal import identify_thermal

        with self.output.opened("model.json", "report.html") as folder:
            robot = self.robot.load()
            logs = self.columns.read(self.log, robot)
            result = identify_thermal(robot, logs, options=self.options, progress=progress)
            self.output.save(folder, result)
        return self.output.printed(result)
