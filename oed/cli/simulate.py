"""``oed simulate``: a virtual experiment."""

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
    QuietOption,
    RobotOption,
    SeedOption,
    TipOption,
    robot_from,
)


def simulate(
    robot: RobotOption,
    trajectory: Annotated[Path, typer.Option("--trajectory", help="A trajectory.csv.", show_default=False)],
    plant: Annotated[
        Path | None,
        typer.Option("--plant", help="A plant YAML; by default the robot's nominal dynamics.", show_default=False),
    ] = None,
    out: Annotated[Path, typer.Option("--out", help="The log to write, .csv or .parquet.")] = Path("log.csv"),
    seed: SeedOption = 0,
    tip: TipOption = None,
    joints: JointsOption = None,
    lock: LockOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Plays a trajectory on a virtual robot and logs t, q and tau."""
    console = Console(json=json, quiet=quiet)
    with console.working() as progress:
        from estimation.logs import write_log
        from oed.exports import read_trajectory
        from robots.plants import load_plant, nominal_plant, simulate as run

        described = robot_from(robot, tip, joints, lock)
        motion, _ = read_trajectory(trajectory, n=described.n)
        progress.start("simulating", None)
        virtual = load_plant(plant, described) if plant else nominal_plant(described)
        log = run(virtual, motion, seed=seed)
        write_log(out, log, force=force)
    data = {"file": str(out), "samples": len(log), "duration": log.duration, "robot": described.name}
    console.result(f"{len(log)} samples, {log.duration:.1f} s, of a virtual {described.name} written to {out}", data)
