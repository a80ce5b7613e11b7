"""``oed simulate``: an experiment on a virtual robot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from oed.cli.console import Console
from oed.cli.options import (
    ROBOT,
    AssumeMassesOption,
    ForceOption,
    JointsOption,
    JsonOption,
    LockOption,
    QuietOption,
    SeedOption,
    TipOption,
    robot_from,
)
from oed.cli.set_up import CarriedOption


def simulate(
    context: typer.Context,
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot", help=f"The robot: {ROBOT}. Default: the robot named in the trajectory file.", show_default=False
        ),
    ] = None,
    trajectory: Annotated[
        Path | None, typer.Option("--trajectory", help="The trajectory.csv to play.", show_default=False)
    ] = None,
    campaign: Annotated[
        Path | None,
        typer.Option(
            "--campaign", help="Folder of an `oed campaign` to play instead of a trajectory.", show_default=False
        ),
    ] = None,
    plant: Annotated[
        Path | None,
        typer.Option(
            "--plant",
            help="YAML file with the virtual robot's true behaviour. Default: the robot's nominal dynamics.",
            show_default=False,
        ),
    ] = None,
    model: Annotated[
        Path | None,
        typer.Option(
            "--model",
            help="A model.json to simulate instead of a plant, extensions included.",
            show_default=False,
        ),
    ] = None,
    payload: CarriedOption = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            help="Log file to write, .csv or .parquet (log.csv); for a campaign, the folder of the logs (logs).",
            show_default=False,
        ),
    ] = None,
    seed: SeedOption = 0,
    tip: TipOption = None,
    joints: JointsOption = None,
    lock: LockOption = None,
    assume_masses: AssumeMassesOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Plays a trajectory or a campaign on a virtual robot.

    Writes logs with t, q and tau.
    """
    console = Console(json=json, quiet=quiet)
    with console.working() as progress:
        from dataclasses import replace

        import numpy as np

        from estimation.logs import write_log
        from estimation.payloads.body import read_body
        from oed.campaigns import Campaign, record
        from oed.exports import read_trajectory
        from robots.common.errors import InputError
        from robots.loading import load_robot
        from robots.plants import load_plant, nominal_plant
        from robots.plants import simulate as run
        from robots.terms.situations.flange_body import with_body

        if (trajectory is None) == (campaign is None):
            raise typer.BadParameter("give either --trajectory or --campaign", ctx=context)
        if model is not None and (plant or campaign):
            raise typer.BadParameter("--model takes the place of --plant and needs a --trajectory", ctx=context)
        if payload is not None and campaign is not None:
            raise typer.BadParameter("--payload needs a --trajectory", ctx=context)
        given = robot_from(robot, tip, joints, lock, assume_masses=assume_masses) if robot else None
        if campaign is not None:
            planned = Campaign.load(campaign, given)
            if given is None and assume_masses is not None:
                planned = replace(planned, robot=load_robot(planned.robot, assume_masses=assume_masses))
            folder = out or Path("logs")
            played = load_plant(plant, planned.robot) if plant else None
            files = record(planned, folder, plant=played, seed=seed, force=force, progress=progress)
            data: dict[str, Any] = {
                "folder": str(folder),
                "files": list(files),
                "samples": planned.samples,
                "duration": planned.duration,
                "robot": planned.robot.name,
                "assumed": list(planned.robot.assumed),
            }
            size = f"{len(files)} logs, {planned.samples} samples, {planned.duration / 60:.1f} min"
            target = folder
        else:
            assert trajectory is not None
            motion, metadata = read_trajectory(trajectory, n=given.n if given else None)
            target = out or Path("log.csv")
            progress.start("simulating", None)
            named = str(metadata.get("robot") or "")
            described = given or (robot_from(named, tip, joints, lock, assume_masses=assume_masses) if named else None)
            if model is not None:
                from estimation import load_model
                from estimation.predictions.virtual_robot import virtual_robot

                obeyed = load_model(model)
                virtual, described = virtual_robot(obeyed, described), described or obeyed.robot
            elif described is not None:
                virtual = load_plant(plant, described) if plant else nominal_plant(described)
            else:
                raise InputError("the file does not name its robot", file=trajectory, remedy="give --robot")
            if payload is not None:
                body = read_body(payload).parameters
                loaded = with_body(virtual.model, np.asarray(virtual.parameters), body)
                virtual = replace(virtual, parameters=loaded)
            log = run(virtual, motion, seed=seed)
            write_log(target, log, force=force, kinds=described.chain.kinds)
            data = {
                "file": str(target),
                "samples": len(log),
                "duration": log.duration,
                "robot": described.name,
                "assumed": list(described.assumed),
            }
            size = f"{len(log)} samples, {log.duration:.1f} s"
    console.result(f"{size} of a virtual {data['robot']} written to {target}", data)
