"""``oed identify``: a robot's dynamic parameters from its logs."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from oed.cli.console import Console
from oed.cli.options import (
    FittedFrictionOption,
    ForceOption,
    JointsOption,
    JsonOption,
    LockOption,
    LogOption,
    MappingOption,
    MjcfOption,
    OutOption,
    PngOption,
    QuietOption,
    RateOption,
    RobotOption,
    SeedOption,
    TipOption,
    robot_from,
    with_rate,
)
from oed.cli.set_up import GravityOption, PayloadOption, TorqueIsOption, with_known_setup, with_torque_meaning

if TYPE_CHECKING:
    from estimation import Estimate
    from estimation.logs.mappings.mapping import LogMapping
    from estimation.logs.parquet_streams import LogStream
    from robots.robot import Robot


def identify(
    robot: RobotOption,
    log: LogOption,
    mapping: MappingOption = None,
    rate: RateOption = None,
    payload: PayloadOption = None,
    gravity: GravityOption = None,
    torque_is: TorqueIsOption = None,
    method: Annotated[
        str,
        typer.Option(
            help="Estimator: wls, ols, huber, tukey, tls, constrained, consistent, iv, ml, didim or recursive; or "
            "`all` to compare them."
        ),
    ] = "wls",
    friction: FittedFrictionOption = "auto",
    position: Annotated[
        bool | None,
        typer.Option(
            help="Include a torque by each joint's position, of unknown cause. By default, where it predicts other "
            "motions better.",
            show_default=False,
        ),
    ] = None,
    rotor: Annotated[bool, typer.Option(help="Include rotor inertias in the model.")] = True,
    offset: Annotated[bool, typer.Option(help="Include a constant torque offset per joint in the model.")] = True,
    stream: Annotated[
        bool | None,
        typer.Option(
            "--stream/--no-stream",
            help="Read a Parquet file, or a folder of parts, in pieces with bounded memory. By default above 5 million "
            "rows.",
            show_default=False,
        ),
    ] = None,
    seed: SeedOption = 0,
    out: OutOption = Path("identified"),
    urdf: Annotated[
        Path | None,
        typer.Option("--urdf", help="Also write a URDF with identified bodies and friction.", show_default=False),
    ] = None,
    mjcf: MjcfOption = None,
    c_code: Annotated[
        Path | None, typer.Option("--c-code", help="Also write C code for torque and gravity.", show_default=False)
    ] = None,
    tip: TipOption = None,
    joints: JointsOption = None,
    lock: LockOption = None,
    png: PngOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Identifies a robot's dynamic parameters with their uncertainty.

    Writes model.json and report.html.
    """
    console = Console(json=json, quiet=quiet, introduces=True)
    with console.working() as progress:
        from estimation import identify as run
        from estimation import read_logs
        from estimation.exports import build_mjcf, build_urdf
        from estimation.exports import c_code as c_text
        from estimation.identifications.streams import METHODS, identify_stream
        from estimation.logs.parquet_streams import is_large
        from estimation.predictions.method_table import compare_methods
        from oed.reports import save_estimate_report
        from robots.common.files import ResultFolder, open_atomic
        from robots.common.records import plain

        with ExitStack() as files:
            folder = files.enter_context(ResultFolder(out, force, names=["model.json", "report.html"]))
            # Opened before the work: an existing file ends the command early, and an error leaves no file behind.
            streams = {
                path: files.enter_context(open_atomic(path, force=force)) for path in (urdf, mjcf, c_code) if path
            }
            described = robot_from(robot, tip, joints, lock)
            options: dict[str, Any] = {
                "friction": friction,
                "position": position,
                "rotor": rotor,
                "offset": offset,
                "seed": seed,
                "progress": progress,
            }
            table, stated = None, None
            if stream or (stream is None and method in METHODS and is_large(log)):
                result = identify_stream(
                    described,
                    _opened(described, log, with_rate(mapping, rate), payload, gravity, torque_is),
                    method=method,
                    **options,
                )
            else:
                read = read_logs(
                    log,
                    n=described.n,
                    mapping=with_rate(mapping, rate),
                    joints=described.joint_names,
                    kinds=described.chain.kinds,
                )
                described, logs = with_torque_meaning(described, with_known_setup(read, payload, gravity), torque_is)
                table = compare_methods(described, logs, **options) if method == "all" else None
                result = run(described, logs, method=method if table is None else table.rows[0].method, **options)
            result.save(folder.path("model.json").parent)
            save_estimate_report(result, folder, png=png, methods=table)
            if urdf is not None:
                stated = build_urdf(result.model, described)
                streams[urdf].write(stated.text.encode())
            written = None if mjcf is None else build_mjcf(result.model, described, folder=mjcf.parent)
            if mjcf is not None and written is not None:
                streams[mjcf].write(written.text.encode())
            if c_code is not None:
                streams[c_code].write(c_text(result.model).encode())
    found = "\n".join(gate.summary() for gate in result.gates if gate.findings)
    weak = _undetermined(result)
    console.result(
        "\n".join(
            [
                *([found] if found else []),
                *([table.summary()] if table else []),
                result.summary(),
                *([f"  below 3 standard errors: {', '.join(weak)}"] if weak else []),
                *(stated.lines() if stated else ()),
                *(written.lines() if written else ()),
                *(f"written to {path.resolve()}" for path in (out, urdf, mjcf, c_code) if path is not None),
            ]
        ),
        {
            **result.to_dict(),
            "gate": [gate.to_dict() for gate in result.gates],
            "below_3_standard_errors": weak,
            "methods": plain(table.rows) if table else None,
            "mjcf": None if written is None else {"stated": list(written.stated), "remarks": list(written.remarks)},
        },
    )


def _opened(
    robot: Robot,
    logs: list[Path],
    mapping: LogMapping | Path | None,
    payload: list[str] | None,
    gravity: list[str] | None,
    torque_is: str | None,
) -> LogStream:
    """Opens the only log, to be read in pieces, with what is known of its setup."""
    from estimation.logs.parquet_streams import open_stream
    from estimation.logs.torque_source import parse_meaning
    from robots.common.errors import InputError

    if len(logs) != 1:
        raise InputError(
            f"--stream with {len(logs)} logs", allowed="one Parquet file or folder", remedy="put the parts in a folder"
        )
    if torque_is is not None:
        parse_meaning(torque_is, robot.n)
    opened = open_stream(logs[0], robot.n, kinds=robot.chain.kinds, torque_is=torque_is, mapping=mapping)
    (known,) = with_known_setup([opened], payload, gravity)
    return known


def _undetermined(result: Estimate) -> list[str]:
    """Lists the parameters below three standard errors, if the gate says that a log does not determine inertias."""
    if not any(finding.name == "undetermined" for gate in result.gates for finding in gate.findings):
        return []
    model = result.model
    pairs = zip(model.names, model.values, model.standard_errors, strict=True)
    return [name for name, value, error in pairs if not abs(value) >= 3.0 * error]
