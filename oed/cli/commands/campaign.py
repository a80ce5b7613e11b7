"""``oed campaign``: repeated excitation, friction and warm-up stages."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from oed.cli.console import Console
from oed.cli.links import (
    ByteOrderOption,
    DownloadOption,
    DriverOption,
    HandshakeOption,
    MotionPortOption,
    PatienceOption,
    PingOption,
    PointsOption,
    RealBytesOption,
    SpeedOption,
    StartToleranceOption,
    StatePortOption,
    ToleranceOption,
    TransportOption,
    WindowOption,
    endpoint,
    is_given,
    refuse_without_host,
    stream_options,
)
from oed.cli.options import (
    AssumeMassesOption,
    ClusterOption,
    CollisionOption,
    FloorOption,
    ForceOption,
    JointsOption,
    JsonOption,
    KeepOutOption,
    LockOption,
    NoFloorOption,
    OutOption,
    PngOption,
    QuietOption,
    RobotOption,
    SeedOption,
    TipOption,
    TorqueMarginOption,
    UnlimitedOption,
    WorkersOption,
    executor_from,
    robot_from,
)

if TYPE_CHECKING:
    from oed.campaigns import Campaign


def campaign(
    context: typer.Context,
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
    velocity_fraction: Annotated[
        float, typer.Option("--velocity-fraction", help="Fraction of the velocity limits to use.")
    ] = 1.0,
    torque_margin: TorqueMarginOption = 0.1,
    collision: CollisionOption = True,
    floor: FloorOption = None,
    no_floor: NoFloorOption = False,
    keep_out: KeepOutOption = None,
    ambient: Annotated[float, typer.Option(help="Ambient temperature [degC].")] = 20.0,
    cold_friction: Annotated[
        float,
        typer.Option(
            help="Friction of the cold robot divided by that of its description, for the temperature forecast."
        ),
    ] = 1.0,
    seed: SeedOption = 0,
    workers: WorkersOption = None,
    cluster: ClusterOption = None,
    run: Annotated[
        str | None,
        typer.Option(
            "--run",
            help=(
                "Play the campaign on the controller at this host, and record each stage. The campaign is planned if "
                "--out holds none yet. After an interruption the same command goes on."
            ),
            show_default=False,
        ),
    ] = None,
    driver: DriverOption = None,
    transport: TransportOption = "udp",
    motion_port: MotionPortOption = 11000,
    state_port: StatePortOption = 11002,
    byte_order: ByteOrderOption = "little",
    real_bytes: RealBytesOption = 4,
    handshake: HandshakeOption = "0x8E",
    points: PointsOption = "full",
    download: DownloadOption = False,
    window: WindowOption = 1,
    patience: PatienceOption = 2.0,
    start_tolerance: StartToleranceOption = 0.01,
    tolerance: ToleranceOption = None,
    ping: PingOption = False,
    speed: SpeedOption = 1.0,
    out: OutOption = Path("campaign"),
    tip: TipOption = None,
    joints: JointsOption = None,
    lock: LockOption = None,
    unlimited: UnlimitedOption = False,
    assume_masses: AssumeMassesOption = None,
    png: PngOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Plans a measurement campaign that warms the robot up, and plays it with --run.

    Writes campaign.json, one CSV file for each stage, and report.html; with --run also run.json and a log for each
    stage in the folder logs.
    """
    console = Console(json=json, quiet=quiet)
    with console.working() as progress:
        from oed.campaigns import Campaign, Programme
        from oed.campaigns import campaign as plan
        from oed.cli.spaces import surroundings_from
        from oed.reports import save_campaign_report
        from robots.common.errors import InputError
        from robots.common.files import ResultFolder

        if run is None:
            refuse_without_host(context, "--run")
        programme = Programme(
            cycles=cycles,
            cycle_time=cycle_time,
            warm_up=warm_up,
            warm_up_range=warm_up_range,
            duties=_duties(duty),
            cooling=cooling,
            power_on=power_on,
        )
        around = surroundings_from(floor, no_floor, keep_out)
        described = robot_from(robot, tip, joints, lock, unlimited=unlimited, assume_masses=assume_masses)
        place = None
        if run is not None:
            place = endpoint(context, run)
        if place is not None and (out / "campaign.json").exists():
            if force:
                raise InputError(
                    "--force with --run would plan the campaign again",
                    file=out,
                    remedy="leave out --force to go on, or choose another folder",
                )
            result = Campaign.load(out, described)
            _refuse_other_settings(
                context,
                out,
                result,
                {
                    **programme.to_dict(),
                    "duty": list(programme.duties),
                    "ambient": ambient,
                    "cold_friction": cold_friction,
                    "torque_margin": torque_margin,
                    "velocity_fraction": velocity_fraction,
                    "collision": collision,
                    **around.settings(),
                    "seed": seed,
                    "design": None if design is None else os.path.abspath(design),
                },
            )
        else:
            names = ["campaign.json", "report.html", *(f"{name}.csv" for name in programme.stage_names)]
            with executor_from(workers, cluster) as executor, ResultFolder(out, force, names=names) as folder:
                result = plan(
                    described,
                    programme=programme,
                    design=design,
                    velocity_fraction=velocity_fraction,
                    torque_margin=torque_margin,
                    collision=collision,
                    surroundings=around,
                    ambient=ambient,
                    cold_friction=cold_friction,
                    seed=seed,
                    workers=workers,
                    executor=executor,
                    progress=progress,
                )
                result.save(folder.path("campaign.json").parent)
                save_campaign_report(result, folder, png=png)
        data = result.to_dict()
        for stage in data["stages"]:
            del stage["segments"], stage["plateaus"]
        summary = f"{result.summary()}\nwritten to {out.resolve()}"
        if place is not None:
            from oed.campaigns.runs import run_campaign
            from oed.controllers.interrupts import terminate_as_interrupt

            options = stream_options(context, speed=speed)
            try:
                with terminate_as_interrupt():
                    played = run_campaign(
                        out,
                        place,
                        robot=described,
                        options=options,
                        speed=speed,
                        collision=collision,
                        progress=progress,
                    )
            except KeyboardInterrupt:
                print("oed: interrupted; the robot was ordered to stop; the same command goes on", file=sys.stderr)
                raise SystemExit(130) from None
            summary, data = played.summary(), played.to_dict()
    console.result(summary, data)


def _refuse_other_settings(context: typer.Context, out: Path, planned: Campaign, given: Mapping[str, Any]) -> None:
    """Refuses options on the command line with which the campaign in the folder was not planned.

    Raises:
        InputError: naming the first one.
    """
    from robots.common.errors import InputError

    programme = planned.programme.to_dict()
    stored = {
        **programme,
        "duty": programme["duties"],
        "ambient": planned.ambient,
        "cold_friction": planned.cold_friction,
        "torque_margin": planned.torque_margin,
        **planned.settings,
    }
    for name, value in given.items():
        if is_given(context, name) and stored.get(name) != value:
            raise InputError(
                f"the campaign was planned with another --{name.replace('_', '-')}: {stored.get(name, 'not known')}",
                file=out / "campaign.json",
                remedy="leave the option out to go on, or choose another folder",
            )


def _duties(text: str) -> tuple[float, ...]:
    from robots.common.errors import InputError

    try:
        return tuple(float(part) / 100.0 for part in text.split(","))
    except ValueError:
        raise InputError(f"--duty {text}", allowed="percentages separated by commas, such as 20,40,60,100") from None
