"""``oed campaign``: repeated excitation, friction and warm-up stages."""

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
    OutOption,
    PngOption,
    QuietOption,
    RobotOption,
    SeedOption,
    TipOption,
    TorqueMarginOption,
    UnlimitedOption,
    VelocityFractionOption,
    WorkersOption,
    robot_from,
)


def campaign(
    robot: RobotOption,
    cycles: Annotated[
        int, typer.Option(help="Heating cycles per run; each one is excitation, friction and warm-up.")
    ] = 24,
    cycle_time: Annotated[float, typer.Option(help="Duration of each cycle [s].")] = 300.0,
    warm_up: Annotated[float, typer.Option(help="Duration of the warm-up in a heating cycle [s].")] = 180.0,
    warm_up_range: Annotated[float, typer.Option(help="Fraction of each joint's range that the warm-up uses.")] = 0.8,
    duty: Annotated[
        str,
        typer.Option(help="Duty cycle of the warm-up [%]. A list such as 20,40,60,100 plans one run for each value."),
    ] = "100",
    cooling: Annotated[
        int, typer.Option(help="Number of friction stages with rest in between after each run, one per cycle time.")
    ] = 0,
    power_on: Annotated[
        float, typer.Option(help="Time with motors on and without motion before the first run [s].")
    ] = 0.0,
    design: Annotated[
        Path | None,
        typer.Option(
            "--design",
            help="Folder of an `oed design` result. Default: a quick design is made now.",
            show_default=False,
        ),
    ] = None,
    velocity_fraction: VelocityFractionOption = 1.0,
    torque_margin: TorqueMarginOption = 0.1,
    collision: Annotated[bool, typer.Option(help="Avoid self-collisions and the obstacles in the robot file.")] = True,
    ambient: Annotated[float, typer.Option(help="Ambient temperature [degC].")] = 20.0,
    cold_friction: Annotated[
        float,
        typer.Option(
            help="Friction of the cold robot divided by that of its description, for the temperature forecast."
        ),
    ] = 1.0,
    seed: SeedOption = 0,
    workers: WorkersOption = None,
    out: OutOption = Path("campaign"),
    tip: TipOption = None,
    joints: JointsOption = None,
    lock: LockOption = None,
    unlimited: UnlimitedOption = False,
    png: PngOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Plans a measurement campaign that warms the robot up.

    Writes campaign.json, one CSV file for each stage, and report.html.
    """
    console = Console(json=json, quiet=quiet)
    with console.working() as progress:
        from oed.campaigns import Programme
        from oed.campaigns import campaign as run
        from oed.reports import save_campaign_report
        from robots.common.files import ResultFolder

        programme = Programme(
            cycles=cycles,
            cycle_time=cycle_time,
            warm_up=warm_up,
            warm_up_range=warm_up_range,
            duties=_duties(duty),
            cooling=cooling,
            power_on=power_on,
        )
        names = ["campaign.json", "report.html", *(f"{name}.csv" for name in programme.stage_names)]
        with ResultFolder(out, force, names=names) as folder:
            result = run(
                robot_from(robot, tip, joints, lock, unlimited=unlimited),
                programme=programme,
                design=design,
                velocity_fraction=velocity_fraction,
                torque_margin=torque_margin,
                collision=collision,
                ambient=ambient,
                cold_friction=cold_friction,
                seed=seed,
                workers=workers,
                progress=progress,
            )
            result.save(folder.path("campaign.json").parent)
            save_campaign_report(result, folder, png=png)
    data = result.to_dict()
    for stage in data["stages"]:
        del stage["segments"], stage["plateaus"]
    console.result(f"{result.summary()}\nwritten to {out.resolve()}", data)


def _duties(text: str) -> tuple[float, ...]:
    from robots.common.errors import InputError

    try:
        return tuple(float(part) / 100.0 for part in text.split(","))
    except ValueError:
        raise InputError(f"--duty {text}", allowed="percentages separated by commas, such as 20,40,60,100") from None
