"""``oed controller``: a robot controller to test against."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from oed.cli.console import Console
from oed.cli.links import (
    ByteOrderOption,
    DriverOption,
    HandshakeOption,
    MotionPortOption,
    RealBytesOption,
    StatePortOption,
    TransportOption,
    controller_options,
)
from oed.cli.options import (
    AssumeMassesOption,
    ForceOption,
    JointsOption,
    JsonOption,
    LockOption,
    QuietOption,
    RobotOption,
    SeedOption,
    TipOption,
    numbers,
    robot_from,
)

LATE = 0.05


def controller(
    context: typer.Context,
    robot: RobotOption,
    plant: Annotated[
        Path | None,
        typer.Option(
            "--plant",
            help="YAML file with the virtual robot's true behaviour. Default: the robot's nominal dynamics.",
            show_default=False,
        ),
    ] = None,
    pose: Annotated[
        str | None,
        typer.Option(
            "--pose",
            help="Where the robot stands [rad or m], comma-separated, or a trajectory.csv with that start.",
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
    capacity: Annotated[int, typer.Option("--capacity", help="Points that the buffer holds.")] = 100,
    feedback: Annotated[
        str,
        typer.Option("--feedback", help="position (JOINT_POSITION), full (JOINT_FEEDBACK), or torque (with torque)."),
    ] = "torque",
    feedback_period: Annotated[
        float, typer.Option("--feedback-period", help="Time between two feedback messages [s].")
    ] = 0.004,
    status: Annotated[bool, typer.Option("--status/--no-status", help="Send status messages, ten a second.")] = True,
    replies: Annotated[
        str, typer.Option("--replies", help="bare: without a body; echo: with the point they reply to.")
    ] = "bare",
    state: Annotated[
        str, typer.Option("--state", help="Reported state: ready, error, e-stop, manual or drives-off.")
    ] = "ready",
    speed: Annotated[float, typer.Option("--speed", help="How many times faster than real time.")] = 1.0,
    wait_for_points: Annotated[
        bool,
        typer.Option("--wait-for-points", help="Time stands still while the buffer is empty; otherwise an error."),
    ] = False,
    duration: Annotated[
        float | None, typer.Option("--duration", help="End after so long [s]. Default: Ctrl-C.", show_default=False)
    ] = None,
    lose: Annotated[float, typer.Option("--lose", help="UDP: share of lost datagrams.")] = 0.0,
    double: Annotated[float, typer.Option("--double", help="UDP: share of doubled datagrams.")] = 0.0,
    late: Annotated[float, typer.Option("--late", help="UDP: share of late datagrams.")] = 0.0,
    late_by: Annotated[float, typer.Option("--late-by", help="Delay of late datagrams [s].")] = LATE,
    reorder: Annotated[float, typer.Option("--reorder", help="UDP: share of reordered datagrams.")] = 0.0,
    silent_after: Annotated[
        int | None, typer.Option("--silent-after", help="Fall silent after so many points.", show_default=False)
    ] = None,
    error_after: Annotated[
        int | None, typer.Option("--error-after", help="Report an error after so many points.", show_default=False)
    ] = None,
    e_stop_after: Annotated[
        int | None, typer.Option("--e-stop-after", help="Emergency stop after so many points.", show_default=False)
    ] = None,
    restart_after: Annotated[
        int | None, typer.Option("--restart-after", help="Restart after so many points.", show_default=False)
    ] = None,
    stuck: Annotated[bool, typer.Option("--stuck", help="Play nothing, so that the buffer never empties.")] = False,
    path_fault: Annotated[
        str,
        typer.Option(
            "--path-fault",
            help="What the robot does wrong: none, swap, sign, half-speed, stall, offset or other-robot.",
        ),
    ] = "none",
    path_fault_after: Annotated[
        float, typer.Option("--path-fault-after", help="Begin with it so long after the start of a trajectory [s].")
    ] = 0.0,
    seed: SeedOption = 0,
    tip: TipOption = None,
    joints: JointsOption = None,
    lock: LockOption = None,
    assume_masses: AssumeMassesOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """A robot controller to test against, on this computer only.

    It plays trajectories on the virtual robot. Faults can be ordered. It writes no files.
    """
    console = Console(json=json, quiet=quiet)
    with console.working():
        import numpy as np

        from oed.controllers import Faults, virtual_controller
        from oed.controllers.interrupts import terminate_as_interrupt
        from oed.exports import read_trajectory
        from robots.common.errors import InputError
        from robots.plants import load_plant

        if duration is not None and not duration > 0:
            raise InputError(f"--duration {duration}", allowed="seconds above 0")
        faults = Faults(
            lose=lose,
            double=double,
            late=late,
            late_by=late_by,
            reorder=reorder,
            silent_after=silent_after,
            error_after=error_after,
            e_stop_after=e_stop_after,
            restart_after=restart_after,
            stuck=stuck,
            path=path_fault,  # type: ignore[arg-type]
            path_after=path_fault_after,
            seed=seed,
        )
        options = controller_options(
            context, status=status, state=state, speed=speed, wait_for_points=wait_for_points, faults=faults
        )
        described = robot_from(robot, tip, joints, lock, assume_masses=assume_masses)
        if pose is not None and pose.endswith(".csv"):
            stands = read_trajectory(pose, n=described.n)[0].q[0]
        else:
            given = numbers("--pose", pose)
            stands = None if given is None else np.array(given)
        played = load_plant(plant, described) if plant else None
        virtual = virtual_controller(described, played, options=options, pose=stands, seed=seed)
        ports = f"motion port {virtual.motion_port}, state port {virtual.state_port}"
        if not quiet:
            print(
                f"{described.name} at {options.host} ({options.transport.upper()}), {ports}",
                file=sys.stderr,
                flush=True,
            )
        with terminate_as_interrupt():
            virtual.serve(duration)
    data = {
        "robot": described.name,
        "points": virtual.points,
        "trajectories": virtual.played,
        "malformed": virtual.malformed,
        "error": virtual.error,
        "stalled": round(virtual.stalled, 3),
    }
    console.result(
        f"{data['points']} points received, {data['trajectories']} trajectories played, {data['malformed']} messages "
        "not understood" + (f"; this computer was late by {virtual.stalled:.2g} s in sum" if virtual.stalled else ""),
        data,
    )
