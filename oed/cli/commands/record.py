"""``oed record``: feedback of a robot controller into a log."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from oed.cli.console import Console
from oed.cli.links import (
    ByteOrderOption,
    DriverOption,
    ExternalAxesOption,
    HandshakeOption,
    HostOption,
    PatienceOption,
    RealBytesOption,
    StatePortOption,
    TransportOption,
    endpoint,
)
from oed.cli.options import (
    ForceOption,
    JointsOption,
    JsonOption,
    LockOption,
    QuietOption,
    RobotOption,
    TipOption,
    robot_from,
)


def record(
    context: typer.Context,
    robot: RobotOption,
    host: HostOption,
    log: Annotated[Path, typer.Option("--log", help="Log file to write, .csv.")] = Path("log.csv"),
    duration: Annotated[
        float | None, typer.Option("--duration", help="Stop after so long [s]. Default: Ctrl-C.", show_default=False)
    ] = None,
    driver: DriverOption = None,
    transport: TransportOption = "udp",
    state_port: StatePortOption = 11002,
    byte_order: ByteOrderOption = "little",
    real_bytes: RealBytesOption = 4,
    handshake: HandshakeOption = "0x8E",
    patience: PatienceOption = 2.0,
    external_axes: ExternalAxesOption = False,
    tip: TipOption = None,
    joints: JointsOption = None,
    lock: LockOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Records the feedback of a robot controller into a log.

    Ctrl-C ends the recording.
    """
    console = Console(json=json, quiet=quiet)
    with console.working() as progress:
        from oed.controllers import record as listen
        from oed.controllers.interrupts import terminate_as_interrupt

        place = endpoint(context, host)
        described = robot_from(robot, tip, joints, lock)
        with terminate_as_interrupt():
            result = listen(
                described,
                place,
                log,
                duration=duration,
                patience=patience,
                external_axes=external_axes,
                force=force,
                progress=progress,
            )
    console.result(result.summary(), result.to_dict())
