"""``oed predict``: the torques of a motion by an identified model."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from oed.cli.console import Console
from oed.cli.options import ForceOption, JsonOption, MappingOption, QuietOption
from oed.cli.set_up import GravityOption, PayloadOption, told

if TYPE_CHECKING:
    from estimation.models.model import Model
    from robots.signals import Log


def predict(
    model: Annotated[Path, typer.Option("--model", help="A model.json, or its folder.", show_default=False)],
    log: Annotated[Path, typer.Option("--log", help="A log of the motion.", show_default=False)],
    mapping: MappingOption = None,
    payload: PayloadOption = None,
    gravity: GravityOption = None,
    before: Annotated[
        list[Path] | None,
        typer.Option(
            "--before",
            help="Of a model with heat: a log of what warmed the robot before, or a folder; may be given again.",
            show_default=False,
        ),
    ] = None,
    ambient: Annotated[
        float | None,
        typer.Option(
            help="Of a model with heat: temperature of the surroundings, where logs do not state it [degC].",
            show_default=False,
        ),
    ] = None,
    out: Annotated[Path, typer.Option("--out", help="The table to write: t, tau1..taun.")] = Path("predicted.csv"),
    band: Annotated[bool, typer.Option("--band", help="Also write band1..bandn, half-widths of 95 %.")] = False,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Predicts the torques of a log's motion, and their error where the log has torque."""
    console = Console(json=json, quiet=quiet)
    with console.working() as progress:
        from estimation import load_model, read_log
        from estimation import predict as run
        from estimation.predictions.prediction import clock_of

        identified = load_model(model)
        robot = identified.robot
        read = read_log(log, n=robot.n, torque=False, mapping=mapping, joints=robot.joint_names)
        (recorded,) = told([read], payload, gravity)
        progress.start("predicting", None)
        later, clock = clock_of(identified, recorded)
        heat = _heat(model, identified, recorded, before or [], ambient, mapping, later)
        result = run(identified, recorded, later=later, **heat.options)
        result.save(out, band=band, force=force)
    summary = "\n".join([result.summary(), *(word for word in (heat.assumed, clock) if word), f"written to {out}"])
    words = {"heat": heat.assumed or None, "clock": clock or None}
    console.result(summary, {"file": str(out), **result.to_dict(), **words})


@dataclass(frozen=True, kw_only=True)
class _Heat:
    """What a model with heat is told, and what that assumes."""

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
    earlier = read_logs(before, n=model.robot.n, mapping=mapping, joints=model.robot.joint_names) if before else []
    if thermal is None:
        if ambient is not None:
            raise InputError("the model has no temperatures", file=file, remedy="leave out --ambient")
        placed, assumed = warmed(model, earlier, log, later)
        return _Heat(options={"before": placed}, assumed=assumed)
    if ambient is not None and not -30.0 <= ambient <= 60.0:
        raise InputError(f"--ambient {ambient}", allowed="-30 to 60 degC")
    start = None
    if before:
        start = start_temperatures(thermal, earlier, float(log.t[0]), ambient=ambient)
        assumed = f"friction with heat: warmed by {len(earlier)} logs before, the first of which began cold"
    else:
        assumed = "friction with heat: the motion is taken to begin cold; --before says what warmed the robot"
    return _Heat(options={"thermal": thermal, "start": start, "ambient": ambient}, assumed=assumed)
