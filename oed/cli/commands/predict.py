"""``oed predict``: joint torques of a motion, by an identified model."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from oed.cli.console import Console
from oed.cli.heat import AmbientOption, BeforeOption, heat_of
from oed.cli.options import (
    ForceOption,
    JsonOption,
    MappingOption,
    QuietOption,
    RateOption,
    with_rate,
)
from oed.cli.set_up import GravityOption, PayloadOption, TorqueIsOption, with_known_setup, with_torque_meaning


def predict(
    model: Annotated[Path, typer.Option("--model", help="A model.json, or its folder.", show_default=False)],
    log: Annotated[Path, typer.Option("--log", help="A log with the motion.", show_default=False)],
    mapping: MappingOption = None,
    rate: RateOption = None,
    payload: PayloadOption = None,
    gravity: GravityOption = None,
    torque_is: TorqueIsOption = None,
    before: BeforeOption = None,
    ambient: AmbientOption = None,
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
        from estimation.predictions.earlier_logs import clock_shift
        from oed.reports import prediction_page, render
        from oed.reports.rendering.provenance import recordings_from
        from robots.common.files import open_atomic

        with ExitStack() as files:
            # Opened before the work: an existing file ends the command early, and an error leaves no file behind.
            page_file = files.enter_context(open_atomic(report, force=force)) if report else None
            identified = load_model(model)
            robot = identified.robot
            read = read_log(
                log,
                n=robot.n,
                torque=False,
                mapping=with_rate(mapping, rate),
                joints=robot.joint_names,
                kinds=robot.chain.kinds,
            )
            _, (recorded,) = with_torque_meaning(robot, with_known_setup([read], payload, gravity), torque_is)
            progress.start("predicting", None)
            later, clock = clock_shift(identified, recorded)
            heat = heat_of(model, identified, recorded, before or [], ambient, with_rate(mapping, rate), later)
            result = run(identified, recorded, later=later, **heat.options)
            result.save(out, force=force)
            if page_file is not None:
                page = prediction_page(
                    result, robot.title or robot.name, robot.chain.kinds, recordings_from([recorded])
                )
                page_file.write(render(page).encode())
    found = [result.gate.summary()] if result.gate is not None and result.gate.findings else []
    summary = "\n".join(
        [*found, result.summary(), *(word for word in (heat.assumed, clock) if word), f"written to {out}"]
    )
    words = {"heat": heat.assumed or None, "clock": clock or None}
    console.result(summary, {"file": str(out), **result.to_dict(), **words})
