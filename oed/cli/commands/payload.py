"""``oed payload``: mass, centre of mass and inertia of a tool or load."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from oed.cli.console import Console
from oed.cli.options import (
    ROBOT,
    ForceOption,
    JointsOption,
    JsonOption,
    LockOption,
    MappingOption,
    OutOption,
    PngOption,
    QuietOption,
    RateOption,
    SeedOption,
    TipOption,
    numbers,
    robot_from,
    with_rate,
)
from oed.cli.set_up import GravityOption, PayloadOption, TorqueIsOption, with_known_setup, with_torque_meaning

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


def payload(
    log: Annotated[list[Path], typer.Option("--log", help="A log with the payload. Repeatable.", show_default=False)],
    without: Annotated[
        list[Path] | None,
        typer.Option(
            "--without",
            help="A log without the payload, best of the same path. Repeatable. Needs only the robot's geometry.",
            show_default=False,
        ),
    ] = None,
    model: Annotated[
        Path | None,
        typer.Option(
            "--model",
            help="A model.json of the robot without the payload, or its folder, instead of --without.",
            show_default=False,
        ),
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option("--robot", help=f"The robot: {ROBOT}. Default: the model's robot.", show_default=False),
    ] = None,
    mapping: MappingOption = None,
    rate: RateOption = None,
    payload: PayloadOption = None,
    gravity: GravityOption = None,
    torque_is: TorqueIsOption = None,
    frame: Annotated[
        str | None,
        typer.Option(
            "--frame",
            help=(
                "Frame of the results, as its pose in the flange frame of the robot's description: X,Y,Z [m] or "
                "X,Y,Z,ROLL,PITCH,YAW [m, rad]. Controller files need the controller's flange."
            ),
            show_default=False,
        ),
    ] = None,
    to: Annotated[
        list[str] | None,
        typer.Option(
            "--to",
            help="Also write what a controller takes: urscript, franka, kuka, ros or urdf. Repeatable.",
            show_default=False,
        ),
    ] = None,
    link: Annotated[
        int | None,
        typer.Option(
            "--link",
            help="The payload is on this link, counted from 1 by the joint that moves it, and in its frame. Default: "
            "on the flange.",
            show_default=False,
        ),
    ] = None,
    seed: SeedOption = 0,
    out: OutOption = Path("payload"),
    tip: TipOption = None,
    joints: JointsOption = None,
    lock: LockOption = None,
    png: PngOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Identifies mass, centre of mass and inertia of a payload, with 95 % intervals.

    Takes two logs of one path, with and without the payload, or one log and a model of the robot without it. Writes
    payload.json, report.html and the files of --to.
    """
    console = Console(json=json, quiet=quiet)
    with console.working() as progress:
        from dataclasses import replace

        import numpy as np

        from estimation import identify_payload, load_model, read_logs
        from estimation.payloads.exports import payload_export
        from oed.reports import save_payload_report
        from robots.common.errors import InputError
        from robots.common.files import ResultFolder

        if not without and model is None:
            raise InputError(
                "a log with a payload alone does not separate the payload from the arm",
                allowed="--without LOG, of the same path without the payload, or --model MODEL.JSON",
            )
        if without and model is not None:
            raise InputError("--without and --model together", allowed="one of them")
        if without and robot is None:
            raise InputError("no robot", remedy="name it with --robot; its geometry is enough")
        if without and any("=" not in text for text in payload or []):
            raise InputError(
                "--payload without a number beside --without",
                allowed="NUMBER=KG,X,Y,Z, because it is not clear whether logs without the payload carry it too",
            )
        if link is not None and to:
            raise InputError("--to and --link together", allowed="a payload on the flange for a controller")
        pose = _pose(frame)
        forms = list(dict.fromkeys(payload_export(name) for words in to or [] for name in words.split(",")))
        with ExitStack() as files:
            names = ["payload.json", "report.html", *(form.file for form in forms)]
            folder = files.enter_context(ResultFolder(out, force, names=names))
            known = load_model(model) if model is not None else None
            described = robot_from(robot, tip, joints, lock) if robot else known.robot if known else None
            assert described is not None
            if known is not None and described.n != known.robot.n:
                raise InputError(
                    f"a model of {known.robot.n} joints", allowed=f"{described.n}, as {described.name} has"
                )
            if known is not None:
                zero = np.zeros((1, described.n))
                if not np.allclose(described.chain.flange(zero), known.robot.chain.flange(zero), atol=1e-4):
                    raise InputError(
                        f"the flange of {described.name} is elsewhere than that of the model's robot",
                        remedy="leave --robot out, state the flange by --frame, or identify the model with this robot",
                    )
            options: dict[str, Any] = {
                "n": described.n,
                "mapping": with_rate(mapping, rate),
                "joints": described.joint_names,
            }
            options["kinds"] = described.chain.kinds
            loaded, free = read_logs(log, **options), read_logs(without, **options) if without else ()
            both = with_known_setup([*loaded, *free], payload, gravity)
            if known is not None:
                stated = np.asarray(described.torque_constant)
                filled = np.where(np.isnan(stated), known.robot.torque_constant, stated)
                described = replace(described, torque_constant=filled)
            described, logs = with_torque_meaning(described, both, torque_is, both[len(loaded) :])
            result = identify_payload(
                logs[: len(loaded)],
                robot=None if known is not None else described,
                without=logs[len(loaded) :],
                model=known,
                link=link,
                seed=seed,
                progress=progress,
            ).seen_from(pose)
            result.save(folder.path("payload.json").parent)
            save_payload_report(result, folder, png=png)
            for form in forms if result.found else ():
                text = form.text(result.seen, result.source)
                folder.path(form.file).write_text(text, encoding="utf-8")
    written = "".join(f"\n{form.title} written to {(out / form.file).resolve()}" for form in forms)
    if forms and not result.found:
        written = "\nno controller file written: there is no payload to state"
    console.result(f"{result.summary()}\nwritten to {out.resolve()}{written}", result.to_dict())


def _pose(text: str | None) -> NDArray[np.float64]:
    """Reads the pose of a frame (4, 4)."""
    import numpy as np

    from robots.common.errors import InputError
    from robots.geometry.chain import homogeneous, rotation_from_rpy

    values = numbers("--frame", text)
    if values is None:
        return np.eye(4)
    if len(values) not in (3, 6) or not np.isfinite(values).all():
        raise InputError(f"--frame {text}", allowed="X,Y,Z [m] or X,Y,Z,ROLL,PITCH,YAW [m, rad]")
    return homogeneous(rotation_from_rpy([*values[3:], 0.0, 0.0, 0.0][:3]), values[:3])
