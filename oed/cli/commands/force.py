"""``oed force``: external forces and contacts of a log, without a force sensor."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from oed.cli.console import Console
from oed.cli.heat import AmbientOption, BeforeOption, heat_of
from oed.cli.options import (
    ForceOption,
    JsonOption,
    MappingOption,
    OutOption,
    PngOption,
    QuietOption,
    RateOption,
    numbers,
    with_rate,
)
from oed.cli.set_up import GravityOption, PayloadOption, TorqueIsOption, with_known_setup, with_torque_meaning

if TYPE_CHECKING:
    from estimation.external_forces import Calibration


def force(
    model: Annotated[Path, typer.Option("--model", help="A model.json, or its folder.", show_default=False)],
    log: Annotated[Path, typer.Option("--log", help="A log with positions and torques.", show_default=False)],
    healthy: Annotated[
        list[Path] | None,
        typer.Option(
            "--healthy",
            help="A log without contacts, from which the threshold follows. Repeatable. Default: the log itself.",
            show_default=False,
        ),
    ] = None,
    calibration: Annotated[
        Path | None,
        typer.Option(
            "--calibration",
            help="A forces.json of an earlier run, whose threshold is used instead of --healthy.",
            show_default=False,
        ),
    ] = None,
    mapping: MappingOption = None,
    rate: RateOption = None,
    payload: PayloadOption = None,
    gravity: GravityOption = None,
    torque_is: TorqueIsOption = None,
    before: BeforeOption = None,
    ambient: AmbientOption = None,
    false_alarms: Annotated[
        float, typer.Option("--false-alarms-per-hour", help="Rate of false alarms of a robot without contact.")
    ] = 1.0,
    bandwidth: Annotated[float, typer.Option("--bandwidth", help="Bandwidth of the observer [Hz].")] = 4.0,
    tool: Annotated[
        str | None,
        typer.Option(
            "--tool",
            help="Tool point in the flange frame, as X,Y,Z [m]. Default: the flange.",
            show_default=False,
        ),
    ] = None,
    velocity: Annotated[
        str,
        typer.Option("--velocity", help="Velocities: smoothed (from positions) or logged (columns dq1..)."),
    ] = "smoothed",
    c_code: Annotated[
        Path | None,
        typer.Option(
            "--c-code",
            help="Also write the observer as C code for a controller; needs --velocity logged.",
            show_default=False,
        ),
    ] = None,
    out: OutOption = Path("forces"),
    png: PngOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Estimates external forces from the drives' torques, and finds contacts.

    Writes forces.csv with the force at each sample, forces.json with the contacts, and report.html.
    """
    console = Console(json=json, quiet=quiet)
    with console.working() as progress, ExitStack() as files:
        from estimation import load_model, predict, read_logs
        from estimation.external_forces import estimate_forces
        from estimation.external_forces.online.c_export import observer_code
        from estimation.models.model import Model
        from estimation.predictions.earlier_logs import clock_shift
        from estimation.predictions.prediction import Prediction
        from oed.reports import save_force_report
        from oed.reports.rendering.provenance import recordings_from
        from robots.common.errors import InputError
        from robots.common.files import ResultFolder, open_atomic
        from robots.signals import Log

        if healthy and calibration is not None:
            raise InputError("--healthy and --calibration together", allowed="one of them")
        if c_code is not None and calibration is None and velocity != "logged":
            raise InputError("--c-code without --velocity logged", remedy="a controller has no smoothed velocities")
        point = numbers("--tool", tool)
        names = ["forces.csv", "forces.json", "report.html"]
        folder = files.enter_context(ResultFolder(out, force, names=names))
        code = None if c_code is None else files.enter_context(open_atomic(c_code, force=force))
        identified = load_model(model)
        robot = identified.robot
        options: dict[str, Any] = {"n": robot.n, "mapping": with_rate(mapping, rate), "joints": robot.joint_names}
        read = read_logs([log, *(healthy or [])], **options, kinds=robot.chain.kinds)
        _, (recorded, *normal) = with_torque_meaning(robot, with_known_setup(read, payload, gravity), torque_is)
        assumed = ""

        def predicted(sharp: Model, own: Log) -> Prediction:
            nonlocal assumed
            later, clock = clock_shift(identified, own)
            heat = heat_of(model, identified, own, before or [], ambient, with_rate(mapping, rate), later)
            if own is recorded:
                assumed = "\n".join(words for words in (heat.assumed, clock) if words)
            return predict(sharp, own, later=later, **heat.options)

        result = estimate_forces(
            identified,
            recorded,
            healthy=normal,
            calibration=None if calibration is None else _calibration(calibration, robot.n),
            false_alarms=false_alarms,
            bandwidth=bandwidth,
            tool=point,
            velocity=velocity,  # type: ignore[arg-type]
            predictor=predicted,
            progress=progress,
        )
        result.save(folder.path("forces.json").parent)
        save_force_report(result, folder, kinds=robot.chain.kinds, logs=recordings_from([recorded]), png=png)
        if code is not None:
            text = observer_code(
                identified, result.calibration, tool=point, gravity=recorded.gravity, payload=recorded.payload
            )
            code.write(text.encode())
    lines = [result.summary(), *([assumed] if assumed else []), f"written to {out.resolve()}"]
    console.result("\n".join(lines), {**result.to_dict(), "heat": assumed or None})


def _calibration(path: Path, joints: int) -> Calibration:
    """Reads the calibration of a forces.json."""
    from estimation.external_forces.thresholds.calibrations import read_calibration

    return read_calibration(path, joints)
