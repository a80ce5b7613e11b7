"""``oed fleet``: many robots of one type, a row each."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from oed.cli.console import Console
from oed.cli.options import (
    ClusterOption,
    ForceOption,
    JsonOption,
    MappingOption,
    OutOption,
    PngOption,
    QuietOption,
    RateOption,
    WorkersOption,
    executor_from,
    with_rate,
)


def fleet(
    folder: Annotated[
        Path,
        typer.Argument(
            help="A folder with a sub-folder of logs per robot (or robot=NAME of a Parquet data set), or a log per "
            "robot.",
            show_default=False,
        ),
    ],
    model: Annotated[
        Path,
        typer.Option(
            "--model",
            help="Model of the healthy robots. A model.json in a robot's folder goes before it.",
            show_default=False,
        ),
    ],
    mapping: MappingOption = None,
    rate: RateOption = None,
    heat: Annotated[str, typer.Option(help="What explains common changes of friction, as for oed monitor.")] = "auto",
    false_alarm_hours: Annotated[
        float, typer.Option(help="Mean time between false alarms of each robot [h of recorded motion].")
    ] = 1000.0,
    window: Annotated[float, typer.Option(help="Length of a window [s].")] = 10.0,
    workers: WorkersOption = None,
    cluster: ClusterOption = None,
    out: OutOption = Path("fleet"),
    png: PngOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Monitors many robots of one type, and lists them, worst first.

    Writes fleet.json, fleet.csv and report.html. Finished robots are kept in the folder robots: a run that was stopped
    goes on from there, and a later run, with --force, takes in new logs only.
    """
    console = Console(json=json, quiet=quiet)
    with console.working(f"finished robots are kept in {out / 'robots'}, and the same command goes on") as progress:
        from estimation.monitoring import MonitorSettings
        from estimation.monitoring.fleets import monitor_fleet
        from oed.reports.pages.monitoring.fleet_report import save_fleet_report
        from robots.common.files import ResultFolder

        settings = MonitorSettings(window=window, false_alarm_hours=false_alarm_hours, heat=heat)  # type: ignore[arg-type]
        with (
            executor_from(workers, cluster) as executor,
            ResultFolder(out, force, names=["fleet.json", "fleet.csv", "report.html"]) as results,
        ):
            result = monitor_fleet(
                folder,
                model,
                kept=out / "robots",
                settings=settings,
                mapping=with_rate(mapping, rate),
                workers=workers,
                executor=executor,
                progress=progress,
            )
            result.save(results.path("fleet.json").parent)
            results.path("fleet.csv")
            save_fleet_report(result, results, png=png)
    console.result(f"{result.summary()}\nwritten to {out.resolve()}", result.to_dict())
