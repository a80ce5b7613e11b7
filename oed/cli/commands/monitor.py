"""``oed monitor``: drift and damage of a robot beside its model."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from oed.cli.console import Console
from oed.cli.options import (
    ForceOption,
    JsonOption,
    MappingOption,
    OutOption,
    PngOption,
    QuietOption,
    RateOption,
    with_rate,
)
from oed.cli.set_up import PayloadOption, TorqueIsOption, with_known_setup, with_torque_meaning

if TYPE_CHECKING:
    from estimation.logs.mappings.mapping import LogMapping
    from estimation.monitoring import LogRow
    from robots.robot import Robot
    from robots.signals import Log


def monitor(
    model: Annotated[
        Path,
        typer.Option(
            "--model",
            help="Model of the healthy robot: a model.json of identify, thermal or diagnose, or its folder.",
            show_default=False,
        ),
    ],
    log: Annotated[
        list[Path] | None,
        typer.Option(
            "--log", help="A log, or a folder of logs, in the order of recording. Repeatable.", show_default=False
        ),
    ] = None,
    log_dir: Annotated[
        Path | None,
        typer.Option("--log-dir", help="A folder of logs. A file that cannot be read is left out.", show_default=False),
    ] = None,
    mapping: MappingOption = None,
    rate: RateOption = None,
    payload: PayloadOption = None,
    torque_is: TorqueIsOption = None,
    heat: Annotated[
        str,
        typer.Option(
            help="What explains common changes of friction: auto, model (thermal model), temperature (measured), "
            "common (assumed time constants) or none."
        ),
    ] = "auto",
    false_alarm_hours: Annotated[
        float, typer.Option(help="Mean time between false alarms [h of recorded motion].")
    ] = 1000.0,
    window: Annotated[float, typer.Option(help="Length of a window [s].")] = 10.0,
    state: Annotated[
        Path | None,
        typer.Option(
            "--state",
            help="File with the monitor's state: continued if it exists, and written at the end.",
            show_default=False,
        ),
    ] = None,
    out: OutOption = Path("monitored"),
    png: PngOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Finds damage, payload changes and contacts in the logs of many days.

    Takes out changes of friction that temperature explains. Writes monitor.json, trends.csv and report.html.
    """
    console = Console(json=json, quiet=quiet)
    with console.working() as progress:
        from estimation.monitoring import Monitor, MonitorSettings, monitor_logs, read_baseline
        from oed.reports.pages.monitoring.monitor_report import save_monitor_report
        from robots.common.errors import InputError
        from robots.common.files import ResultFolder

        if not log and log_dir is None:
            raise InputError("no logs", remedy="give --log, or --log-dir with a folder")
        with ResultFolder(out, force, names=["monitor.json", "trends.csv", "report.html"]) as folder:
            settings = MonitorSettings(window=window, false_alarm_hours=false_alarm_hours, heat=heat)  # type: ignore[arg-type]
            if state is not None and state.exists():
                watcher = Monitor.load(state)
                _require_same(watcher, model, settings, state)
            else:
                watcher = Monitor(read_baseline(model), settings)
            robot = watcher.baseline.robot
            logs, refused = _read(log or [], log_dir, robot, with_rate(mapping, rate))
            _, logs = with_torque_meaning(robot, with_known_setup(logs, payload, None), torque_is)
            result = monitor_logs(watcher, logs, refused=refused, progress=progress)
            result.save(folder.path("monitor.json").parent)
            folder.path("trends.csv")
            save_monitor_report(result, folder, png=png)
            if state is not None:
                watcher.save(state)
    console.result(f"{result.summary()}\nwritten to {out.resolve()}", result.to_dict())


def _read(
    paths: list[Path], folder: Path | None, robot: Robot, mapping: LogMapping | Path | None
) -> tuple[list[Log], list[LogRow]]:
    """Reads logs; those of a folder that cannot be read become rows.

    Raises:
        InputError: a named log that cannot be read, or a folder without any log that can.
    """
    from estimation import read_log
    from estimation.logs.campaigns import log_files
    from estimation.monitoring.stored_logs.log_files import read_each
    from robots.common.errors import InputError

    named = [file for path in paths for file in (log_files(path) if path.is_dir() else [path])]
    logs = [read_log(file, mapping=mapping, joints=robot.joint_names, kinds=robot.chain.kinds) for file in named]
    more, refused = ([], []) if folder is None else read_each(log_files(folder), robot, mapping)
    if not logs and not more:
        raise InputError("no log in the folder can be read", file=folder, remedy=refused[0].note)
    return [*logs, *more], refused


def _require_same(watcher: object, model: Path, settings: object, state: Path) -> None:
    """Refuses a state of another model or of other settings.

    Raises:
        InputError: naming what differs.
    """
    from estimation.monitoring import Monitor, read_baseline
    from robots.common.errors import InputError

    assert isinstance(watcher, Monitor)
    if dict(read_baseline(model).source) != dict(watcher.baseline.source):
        raise InputError(
            "the state is of another model", file=state, remedy="give the model of this state, or another --state file"
        )
    if watcher.settings != settings:
        raise InputError(
            f"the state has other settings: {watcher.settings}",
            file=state,
            remedy="give the same settings, or another --state file",
        )
