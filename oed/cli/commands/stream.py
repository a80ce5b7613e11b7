"""``oed stream``: plays a trajectory on a robot controller and records the feedback."""

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
    ExternalAxesOption,
    HandshakeOption,
    HostOption,
    MotionPortOption,
    PatienceOption,
    PingOption,
    PointsOption,
    RealBytesOption,
    StartToleranceOption,
    StatePortOption,
    ToleranceOption,
    TransportOption,
    WindowOption,
    endpoint,
    stream_options,
)
from oed.cli.options import (
    ROBOT,
    CollisionOption,
    FloorOption,
    ForceOption,
    JointsOption,
    JsonOption,
    KeepOutOption,
    LockOption,
    NoFloorOption,
    QuietOption,
    TipOption,
    robot_of_file,
)


def stream(
    context: typer.Context,
    trajectory: Annotated[Path, typer.Argument(help="A trajectory.csv.", show_default=False)],
    host: HostOption,
    log: Annotated[Path, typer.Option("--log", help="Log file to write, .csv.")] = Path("log.csv"),
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot", help=f"The robot: {ROBOT}. Default: the robot named in the trajectory file.", show_default=False
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
    period: Annotated[
        float | None,
        typer.Option(
            "--period", help="Time between two points [s]. Default: that of the trajectory.", show_default=False
        ),
    ] = None,
    external_axes: ExternalAxesOption = False,
    reply_time: Annotated[
        float, typer.Option("--reply-time", help="UDP: send a point again after so long without a reply [s].")
    ] = 0.1,
    patience: PatienceOption = 2.0,
    start_tolerance: StartToleranceOption = 0.01,
    robot_id: Annotated[int, typer.Option("--robot-id", help="Number of the robot at its controller.")] = 0,
    tolerance: ToleranceOption = None,
    ping: PingOption = False,
    ignore_status: Annotated[
        bool, typer.Option("--ignore-status", help="Start in spite of a reported error, e-stop or manual mode.")
    ] = False,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Check trajectory, controller and pose; only listen.")
    ] = False,
    collision: CollisionOption = True,
    floor: FloorOption = None,
    no_floor: NoFloorOption = False,
    keep_out: KeepOutOption = None,
    tip: TipOption = None,
    joints: JointsOption = None,
    lock: LockOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Plays a trajectory on a robot controller by simple_message or RTDE.

    Records the feedback into a log.
    """
    console = Console(json=json, quiet=quiet)
    with console.working() as progress:
        from oed.cli.spaces import surroundings_from
        from oed.controllers import stream as play
        from oed.controllers.interrupts import terminate_as_interrupt
        from oed.experiments.safety_checks.freedom import require_free
        from oed.exports import check_trajectory, read_trajectory
        from oed.exports.forms.sampling import at_period
        from oed.exports.trajectory_checks import stated_collisions
        from robots.collision import Surroundings

        place = endpoint(context, host)
        options = stream_options(
            context, reply_time=reply_time, ignore_status=ignore_status, robot_id=robot_id, external_axes=external_axes
        )
        motion, metadata = read_trajectory(trajectory)
        if period is not None:
            motion = at_period(motion, period)
        described = robot_of_file(robot, metadata, trajectory, tip, joints, lock)
        around = surroundings_from(floor, no_floor, keep_out)
        # What a design has proved need not be proved again, unless other surroundings are stated.
        proved = stated_collisions(metadata)[1] and around == Surroundings()
        check_trajectory(motion, described, metadata, trajectory)
        if collision and not proved:
            require_free(around.model(described), motion, trajectory)
        try:
            with terminate_as_interrupt():
                result = play(
                    motion,
                    described,
                    place,
                    log=None if dry_run else log,
                    options=options,
                    metadata=metadata,
                    file=trajectory,
                    dry_run=dry_run,
                    force=force,
                    progress=progress,
                )
        except KeyboardInterrupt:
            if log.exists() and not dry_run:
                text = f"the robot was ordered to stop; the feedback up to here is in {log}"
            else:
                text = "no point was sent"
            print(f"oed: interrupted; {text}", file=sys.stderr)
            raise SystemExit(130) from None
    console.result(result.summary(), result.to_dict())
