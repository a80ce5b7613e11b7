"""Monitors many robots of one type, and lists them, worst first.

Writes fleet.json, fleet.csv and report.html. Finished robots are kept in the folder robots: a run that was stopped
goes on from there, and a later run, with --force, takes in new logs only.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from estimation.monitoring.settings import MonitorSettings
from oed.cli.options.logs import Columns
from oed.cli.options.results import Folder
from oed.cli.options.work import Processes
from oed.cli.verbs import Printed, Verb
from robots.common.options import Option
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Fleet(Verb):
    """``oed fleet``.

    Attributes:
        folder: a folder with a sub-folder of logs per robot (or robot=NAME of a Parquet data set), or a log per robot.
        model: model of the healthy robots. A model.json in a robot's folder goes before it.
    """

    function = "estimation.monitor_fleet"
    examples = (
        "oed fleet logs_of_all_robots --model model --workers 4 --out fleet",
        "oed fleet logs_of_all_robots --model model --cluster tcp://192.168.1.10:8786 --out fleet",
    )

    folder: Annotated[Path, Option(argument=True)]
    model: Path
    columns: Columns = Columns()
    settings: MonitorSettings = MonitorSettings()
    work: Processes = Processes()
    output: Folder = Folder(out=Path("fleet"))

    def kept(self) -> str:
        """Says that the same command goes on."""
        return f"finished robots are kept in {self.output.out / 'robots'}, and the same command goes on"

    def run(self, progress: Progress) -> Printed:
        """Monitors the robots."""
        from estimation.monitoring.fleets import monitor_fleet

        names = ("fleet.json", "fleet.csv", "report.html")
        with self.work.executor() as executor, self.output.opened(*names) as results:
            result = monitor_fleet(
                self.folder,
                self.model,
                kept=self.output.out / "robots",
                settings=self.settings,
                mapping=self.columns.stated,
                workers=self.work.workers,
                executor=executor,
                progress=progress,
            )
            self.output.save(results, result)
        return self.output.printed(result)
