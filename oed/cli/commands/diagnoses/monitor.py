"""Finds damage, payload changes and contacts in the logs of many days.

Takes out changes of friction that temperature explains. Writes monitor.json, trends.csv and report.html.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from estimation.monitoring.settings import MonitorSettings
from oed.cli.options.logs import LoadedLogs
from oed.cli.options.results import Folder
from oed.cli.verbs import Printed, Verb
from robots.common.errors import InputError
from robots.common.progress import Progress

if TYPE_CHECKING:
    from estimation.monitoring import LogRow
    from estimation.monitoring import Monitor as Watcher
    from robots.robot import Robot
    from robots.signals import Log


@dataclass(frozen=True, kw_only=True)
class Monitor(Verb):
    """``oed monitor``.

    Attributes:
        model: model of the healthy robot: a model.json of identify, thermal or diagnose, or its folder.
        log: a log, or a folder of logs, in the order of recording. Repeatable.
        log_dir: a folder of logs. A file that cannot be read is left out, with the reason.
        state: file with the monitor's state: continued if it exists, and written at the end.
    """

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
        from estimation.monitoring import monitor_logs
        from oed.reports.pages.monitoring.monitor_report import save_monitor_report

        if not self.log and self.log_dir is None:
            raise InputError("no logs", remedy="give --log, or --log-dir with a folder")
        with self.output.opened("monitor.json", "trends.csv", "report.html") as folder:
            watcher = self._watcher()
            robot = watcher.baseline.robot
            read, refused = self._read(robot)
            _, logs = self.known.as_joint_torque(robot, self.known.with_setup(read))
            result = monitor_logs(watcher, logs, refused=refused, progress=progress)
            result.save(folder.path("monitor.json").parent)
            folder.path("trends.csv")
            save_monitor_report(result, folder, png=self.output.png)
            if self.state is not None:
                watcher.save(self.state)
        return self.output.printed(result)

    def _read(self, robot: Robot) -> tuple[list[Log], list[LogRow]]:
        """Reads logs; those of a folder that cannot be read become rows.

        Raises:
            InputError: a named log that cannot be read, or a folder without any log that can.
        """
        from estimation import read_log
        from estimation.logs.campaigns import log_files
        from estimation.monitoring.stored_logs.log_files import read_each

        mapping, folder = self.known.stated, self.log_dir
        named = [file for path in self.log for file in (log_files(path) if path.is_dir() else [path])]
        logs = [read_log(file, mapping=mapping, joints=robot.joint_names, kinds=robot.chain.kinds) for file in named]
        more, refused = ([], []) if folder is None else read_each(log_files(folder), robot, mapping)
        if not logs and not more:
            raise InputError("no log in the folder can be read", file=folder, remedy=refused[0].note)
        return [*logs, *more], refused

    def _watcher(self) -> Watcher:
        """Makes the monitor, or loads its state.

        Raises:
            InputError: a state of another model or of other settings.
        """
        from estimation.monitoring import Monitor as Watcher
        from estimation.monitoring import read_baseline

        baseline, state = read_baseline(self.model), self.state
        if state is None or not state.exists():
            return Watcher(baseline, self.settings)
        watcher = Watcher.load(state)
        if dict(baseline.source) != dict(watcher.baseline.source):
            raise InputError(
                "the state is of another model",
                file=state,
                remedy="give the model of this state, or another --state file",
            )
        if watcher.settings != self.settings:
            raise InputError(
                f"the state has other settings: {watcher.settings}",
                file=state,
                remedy="give the same settings, or another --state file",
            )
        return watcher
