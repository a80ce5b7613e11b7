"""``oed retime``: the same path with a new timing."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from oed.cli.console import Console
from oed.cli.options import (
    ROBOT,
    CollisionOption,
    FloorOption,
    ForceOption,
    FrictionOption,
    JsonOption,
    KeepOutOption,
    NoFloorOption,
    OutOption,
    PngOption,
    QuietOption,
    robot_from,
)


def retime(
    trajectory: Annotated[
        Path, typer.Argument(help="A trajectory.csv, or a CSV of waypoints: q1..qn without t.", show_default=False)
    ],
    method: Annotated[
        str,
        typer.Option(
            help=(
                "Method: toppra follows the path exactly; ruckig replaces it by straight lines and stops at their "
                "corners."
            )
        ),
    ] = "toppra",
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot",
            help=f"The robot: {ROBOT}. Default: the robot named in the trajectory file.",
            show_default=False,
        ),
    ] = None,
    criterion: Annotated[
        str, typer.Option(help="Criterion to report before and after: cond, d, a, e or cond-d.")
    ] = "cond",
    friction: FrictionOption = "polynomial",
    tolerance: Annotated[
        float, typer.Option(help="Largest allowed deviation of ruckig's straight lines from the path [rad].")
    ] = 0.01,
    collision: CollisionOption = True,
    floor: FloorOption = None,
    no_floor: NoFloorOption = False,
    keep_out: KeepOutOption = None,
    out: OutOption = Path("retimed"),
    png: PngOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Retimes a trajectory, or times a list of waypoints, within the robot's limits.

    Writes trajectory.csv, design.json and report.html.
    """
    console = Console(json=json, quiet=quiet)
    with console.working() as progress:
        from oed.cli.spaces import surroundings_from
        from oed.experiments import retime as run
        from oed.experiments.retiming import move_with_stops
        from oed.exports import read_trajectory, read_waypoints
        from oed.reports import save_retime_report
        from robots.common.errors import InputError
        from robots.common.files import ResultFolder

        with ResultFolder(out, force, names=["trajectory.csv", "design.json", "report.html"]) as folder:
            described = robot_from(robot) if robot else None
            points = read_waypoints(trajectory, robot=described)
            if points is None:
                motion, metadata = read_trajectory(trajectory)
                if described is None and metadata.get("robot"):
                    described = robot_from(str(metadata["robot"]))
            if described is None:
                raise InputError("the file does not name its robot", file=trajectory, remedy="give --robot")
            if points is not None:
                motion = move_with_stops(described, points)
            progress.start(f"retiming by {method}", None)
            result = run(
                described,
                motion if points is None else points,
                method=method,
                criterion=criterion,
                friction=friction,
                tolerance=tolerance,
                collision=collision,
                surroundings=surroundings_from(floor, no_floor, keep_out),
            )
            result.save(folder.path("trajectory.csv").parent)
            save_retime_report(result, motion, folder, png=png)
    console.result(f"{result.summary()}\nwritten to {out.resolve()}", result.to_dict())
