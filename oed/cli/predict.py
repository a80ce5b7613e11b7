"""``oed predict``: the torques of a motion by an identified model."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from oed.cli.console import Console
from oed.cli.options import ForceOption, JsonOption, MappingOption, QuietOption


def predict(
    model: Annotated[Path, typer.Option("--model", help="A model.json, or its folder.", show_default=False)],
    log: Annotated[Path, typer.Option("--log", help="A log of the motion.", show_default=False)],
    mapping: MappingOption = None,
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

        identified = load_model(model)
        robot = identified.robot
        recorded = read_log(log, n=robot.n, torque=False, mapping=mapping, joints=robot.joint_names)
        progress.start("predicting", None)
        result = run(identified, recorded)
        result.save(out, band=band, force=force)
    console.result(f"{result.summary()}\nwritten to {out}", {"file": str(out), **result.to_dict()})
