"""``oed identify``: a robot's parameters from its logs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from oed.cli.console import Console
from oed.cli.options import (
    ForceOption,
    JointsOption,
    JsonOption,
    LockOption,
    LogOption,
    PngOption,
    QuietOption,
    RobotOption,
    SeedOption,
    TipOption,
    robot_from,
)


def identify(
    robot: RobotOption,
    log: LogOption,
    method: Annotated[str, typer.Option(help="wls or ols.")] = "wls",
    friction: Annotated[str, typer.Option(help="polynomial or coulomb-viscous.")] = "polynomial",
    rotor: Annotated[bool, typer.Option(help="With rotor inertias.")] = True,
    offset: Annotated[bool, typer.Option(help="With a torque offset on each joint.")] = True,
    seed: SeedOption = 0,
    out: Annotated[Path, typer.Option("--out", help="Folder for the results.")] = Path("identified"),
    tip: TipOption = None,
    joints: JointsOption = None,
    lock: LockOption = None,
    png: PngOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Identifies parameters with uncertainties: model.json and report.html."""
    console = Console(json=json, quiet=quiet)
    with console.working() as progress:
        from estimation import identify as run
        from estimation import read_logs
        from oed.reports import save_estimate_report
        from robots.common.files import ResultFolder

        with ResultFolder(out, force, names=["model.json", "report.html"]) as folder:
            described = robot_from(robot, tip, joints, lock)
            logs = read_logs(log, n=described.n)
            result = run(
                described,
                logs,
                method=method,
                friction=friction,
                rotor=rotor,
                offset=offset,
                seed=seed,
                progress=progress,
            )
            result.save(folder.path("model.json").parent)
            save_estimate_report(result, folder, png=png)
    console.result(f"{result.summary()}\nwritten to {out.resolve()}", result.to_dict())
