"""``oed retime``: the same path with another timing."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from oed.cli.console import Console
from oed.cli.options import (
    ROBOT,
    ForceOption,
    FrictionOption,
    JsonOption,
    OutOption,
    PngOption,
    QuietOption,
    robot_from,
)


def retime(
    trajectory: Annotated[Path, typer.Argument(help="A trajectory.csv.", show_default=False)],
    method: Annotated[str, typer.Option(help="toppra follows the path; ruckig stops at its vertices.")] = "toppra",
    robot: Annotated[
        str | None,
        typer.Option("--robot", help=f"{ROBOT}; by default the one that the file names.", show_default=False),
    ] = None,
    criterion: Annotated[str, typer.Option(help="The criterion to compare: cond, d, a, e or cond-d.")] = "cond",
    friction: FrictionOption = "polynomial",
    tolerance: Annotated[float, typer.Option(help="How far ruckig's polyline may leave the path [rad].")] = 0.01,
    out: OutOption = Path("retimed"),
    png: PngOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Retimes a path within the robot's limits: trajectory.csv, design.json and report.html."""
    console = Console(json=json, quiet=quiet)
    with console.working() as progress:
        from oed.experiments import retime as run
        from oed.exports import read_trajectory
        from oed.reports import save_retime_report
        from robots.common.errors import InputError
        from robots.common.files import ResultFolder

        with ResultFolder(out, force, names=["trajectory.csv", "design.json", "report.html"]) as folder:
            motion, metadata = read_trajectory(trajectory)
            named = robot or metadata.get("robot")
            if not named:
                raise InputError("the file names no robot", file=trajectory, remedy="give --robot")
            progress.start(f"retiming by {method}", None)
            result = run(
                robot_from(str(named)),
                motion,
                method=method,
                criterion=criterion,
                friction=friction,
                tolerance=tolerance,
            )
            result.save(folder.path("trajectory.csv").parent)
            save_retime_report(result, motion, folder, png=png)
    console.result(f"{result.summary()}\nwritten to {out.resolve()}", result.to_dict())
