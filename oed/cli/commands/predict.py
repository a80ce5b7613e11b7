"""``oed predict``: joint torques of a motion, by an identified model."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from oed.cli.console import Console
from oed.cli.options import ForceOption, JsonOption, MappingOption, QuietOption
from oed.cli.set_up import GravityOption, PayloadOption, TorqueIsOption, with_known_setup, with_torque_meaning

if TYPE_CHECKING:
    from estimation.models.model import Model
    from robots.signals import Log


def predict(
    model: Annotated[Path, typer.Option("--model", help="A model.json, or its folder.", show_default=False)],
    log: Annotated[Path, typer.Option("--log", help="A log with the motion.", show_default=False)],
    mapping: MappingOption = None,
    payload: PayloadOption = None,
    gravity: GravityOption = None,
    torque_is: TorqueIsOption = None,
    before: Annotated[
        list[Path] | None,
        typer.Option(
            "--before",
            help="Thermal model: a log, or a folder of logs, of the robot's motion before this log. Repeatable.",
            show_default=False,
        ),
    ] = None,
    ambient: Annotated[
        float | None,
        typer.Option(
            help="Thermal model: ambient temperature of logs that do not state it [degC].",
            show_default=False,
        ),
    ] = None,
    out: Annotated[Path, typer.Option("--out", help="CSV file to write: torques and their 95 % bands.")] = Path(
        "predicted.csv"
    ),
    report: Annotated[
        Path | None,
        typer.Option("--report", help="Also write a page with pictures to this HTML file.", show_default=False),
    ] = None,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Predicts the joint torques of a logged motion.

    If the log has torques, the prediction errors are printed.
    """
    console = Console(json=json, quiet=quiet)
    with console.working() as progress:
        from estimation import load_model, read_log
        from estimation import predict as run
        from estimation.predictions.prediction import clock_shift
        from oed.reports import prediction_page, render
        from robots.common.files import open_atomic

        with ExitStack() as files:
            # Opened before the work: an existing file ends the command early, and an error leaves no file behind.
            page_file = files.enter_context(open_atomic(report, force=force)) if report else None
            identified = load_model(model)
            robot = identified.robot
            read = read_log(
                log, n=robot.n, torque=False, mapping=mapping, joints=robot.joint_names, kinds=robot.chain.kinds
            )
            (recorded,) = with_torque_meaning(robot, with_known_setup([read], payload, gravity), torque_is)
            progress.start("predicting", None)
            later, clock = clock_shift(identified, recorded)
            heat = _heat(model, identified, recorded, before or [], ambient, mapping, later)
            result = run(identified, recorded, later=later, **heat.options)
            result.save(out, force=force)
            if page_file is not None:
                page = prediction_page(result, robot.name, robot.chain.kinds)
                page_file.write(render(page).encode())
    found = [result.gate.summary()] if result.gate is not None and result.gate.findings else []
    summary = "\n".join(
        [*found, result.summary(), *(word for word in (heat.assumed, clock) if word), f"written to {out}"]
    )
    words = {"heat": heat.assumed or None, "clock": clock or None}
    console.result(summary, {"file": str(out), **result.to_dict(), **words})


@dataclass(frozen=True, kw_only=True)
class _Heat:
    """Thermal inputs of a prediction, and a sentence on the assumed initial state."""

    options: dict[str, Any] = field(default_factory=dict)
    assumed: str = ""


def _heat(
    path: Path,
    model: Model,
    log: Log,
    before: list[Path],
    ambient: float | None,
    mapping: Path | None,
    later: float,
) -> _Heat:
    import json as codec

    from estimation import read_logs
    from estimation.predictions.prediction import warmed
    from estimation.thermal import start_temperatures, thermal_from_dict
    from robots.common.errors import InputError

    file = path / "model.json" if path.is_dir() else path
    thermal = thermal_from_dict(model, codec.loads(file.read_text(encoding="utf-8")))
    robot = model.robot
    names, kinds = robot.joint_names, robot.chain.kinds
    earlier = read_logs(before, n=robot.n, mapping=mapping, joints=names, kinds=kinds) if before else []
    if thermal is None:
        if ambient is not None:
            raise InputError(
                "the model has no thermal part", file=file, remedy="remove --ambient, or use a model of `oed thermal`"
            )
        placed, assumed = warmed(model, earlier, log, later)
        return _Heat(options={"before": placed}, assumed=assumed)
    if ambient is not None and not -30.0 <= ambient <= 60.0:
        raise InputError(f"--ambient {ambient}", allowed="-30 to 60 degC")
    start = None
    if before:
        start = start_temperatures(thermal, earlier, float(log.t[0]), ambient=ambient)
        assumed = (
            f"thermal friction: initial temperatures computed from {len(earlier)} earlier logs; the first is assumed "
            f"to start cold"
        )
    else:
        assumed = (
            "thermal friction: the robot is assumed cold at the start; give earlier logs with --before if it was warm"
        )
    return _Heat(options={"thermal": thermal, "start": start, "ambient": ambient}, assumed=assumed)
