"""Finds damage, payload changes and contacts in the logs of many days.

Takes out changes of friction that temperature explains. Writes monitor.json, trends.csv and report.html.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from estimation.monitoring.settings import MonitorSettings
from oed.cli.options.logs import LoadedLogs
from oed.cli.options.results import Folder
from oed.cli.verbs import Printed, Verb
from robots.common.errors import InputError
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Monitor(Verb):
    """``oed monitor``.

    Attributes:
        model: model of the healthy robot: a model.json of identify, thermal or diagnose, or its folder.
        log: a log, or a folder of logs, in the order of recording. Repeatable.
        log_dir: a folder of logs. A file that cannot be read is left out, with the reason.
        state: file with the monitor's state: continued if it exists, and written at the end.
    """

    function = "estimation.monitor_logs"
    examples = (
        "oed monitor --model thermal --log day1.csv day2.csv day3.csv --out monitored",
        "oed monitor --model model --log-dir logs --state robot7.state --out monitored --force",
    )

    model: Path
    log: tuple[Path, ...] = ()
    log_dir: Path | None = None
    known: LoadedLogs = LoadedLogs()
    settings: MonitorSettings = MonitorSettings()
    state: Path | None = None
    output: Folder = Folder(out=Path("monitored"))

    def run(self, progress: Progress) -> Printed:
        """Sends the logs through the monitor."""
        from estimation.monitoring import monitor_logs, open_monitor, read_monitored

        if not self.log and self.log_dir is None:
            raise InputError("no logs", remedy="give --log, or --log-dir with a folder")
        with self.output.opened("monitor.json", "trends.csv", "report.html") as folder:
            watcher = open_monitor(self.model, state=self.state, settings=self.settings)
            robot = watcher.baseline.robot
            read, refused = read_monitored(self.log, self.log_dir, robot, self.known.stated)
            _, logs = self.known.as_joint_torque(robot, self.known.with_setup(read))
            result = monitor_logs(watcher, logs, refused=refused, progress=progress)
            self.output.save(folder, result)
            if self.state is not None:
                watcher.save(self.state)
        return self.output.printed(result)
