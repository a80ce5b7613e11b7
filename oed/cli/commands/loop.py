"""``oed loop``: experiments on a controller until the diagnosis leaves nothing ambiguous."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from oed.cli.console import Console
from oed.cli.links import (
    ByteOrderOption,
    DownloadOption,
    DriverOption,
    HandshakeOption,
    HostOption,
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
    stream_options,
)
from oed.cli.options import (
    ClusterOption,
    CollisionOption,
    FittedFrictionOption,
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
    UnlimitedOption,
    VelocityFractionOption,
    WorkersOption,
    executor_from,
    robot_from,
)


def loop(
    context: typer.Context,
    robot: RobotOption,
    host: HostOption,
    experiments: Annotated[
        int, typer.Option("--experiments", help="Number of experiments at most, the first one included.")
    ] = 4,
    least_probability: Annotated[
        float,
        typer.Option(
            "--least-probability", help="An experiment that separates the causes with less probability is not made."
        ),
    ] = 0.5,
    longest: Annotated[
        float,
        typer.Option("--longest", help="Repetitions beyond this time of an experiment are left to the next one [s]."),
    ] = 600.0,
    design: Annotated[
        Path | None,
        typer.Option(
            "--design",
            help="Folder of an `oed design` result for the first experiment. Default: one is designed.",
            show_default=False,
        ),
    ] = None,
    effort: Annotated[str, typer.Option("--effort", help="Effort of the design: quick, standard or thorough.")] = (
        "standard"
    ),
    friction: FittedFrictionOption = "auto",
    velocity_fraction: VelocityFractionOption = None,
    collision: CollisionOption = True,
    floor: FloorOption = None,
    no_floor: NoFloorOption = False,
    keep_out: KeepOutOption = None,
    seed: SeedOption = 0,
    workers: WorkersOption = None,
    cluster: ClusterOption = None,
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
    out: OutOption = Path("loop"),
    tip: TipOption = None,
    joints: JointsOption = None,
    lock: LockOption = None,
    unlimited: UnlimitedOption = False,
    png: PngOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Designs and plays experiments until the diagnosis leaves nothing ambiguous.

    Each experiment is played on the robot controller, recorded, identified and diagnosed. The next one separates the
    causes that are still open. After an interruption the same command goes on. Writes loop.json, diagnosis.json,
    model.json, report.html, and a folder for each experiment.
    """
    console = Console(json=json, quiet=quiet)
    with console.working() as progress:
        from oed.campaigns.loops import LoopOptions, run_loop
        from oed.cli.spaces import surroundings_from
        from oed.controllers.interrupts import terminate_as_interrupt
        from oed.reports import save_diagnosis_report, save_loop_report
        from robots.common.files import ResultFolder

        described = robot_from(robot, tip, joints, lock, unlimited=unlimited)
        place = endpoint(context, host)
        try:
            with executor_from(workers, cluster) as executor, terminate_as_interrupt():
                result = run_loop(
                    described,
                    place,
                    out,
                    design=design,
                    options=LoopOptions(
                        experiments=experiments,
                        least_probability=least_probability,
                        longest=longest,
                        friction=friction,
                        velocity_fraction=velocity_fraction,
                        effort=effort,
                        collision=collision,
                        surroundings=surroundings_from(floor, no_floor, keep_out),
                        seed=seed,
                    ),
                    stream_options=stream_options(context, speed=speed),
                    speed=speed,
                    workers=workers,
                    executor=executor,
                    force=force,
                    report=save_diagnosis_report,
                    progress=progress,
                )
        except KeyboardInterrupt:
            print("oed: interrupted; the robot was ordered to stop; the same command goes on", file=sys.stderr)
            raise SystemExit(130) from None
        with ResultFolder(out, True, names=["report.html"]) as folder:
            save_loop_report(result, folder, png=png)
    console.result(f"{result.summary()}\nwritten to {out.resolve()}", result.to_dict())
    if not result.success:
        raise SystemExit(1)
