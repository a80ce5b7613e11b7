"""``oed compare``: identified models of several runs, days or robots against each other."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from oed.cli.console import Console
from oed.cli.options import (
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
    robot_from,
    with_rate,
)


def compare(
    models: Annotated[
        list[Path],
        typer.Argument(
            help="Two or more model.json files or their folders; with --robot, logs or folders of logs.",
            show_default=False,
        ),
    ],
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot",
            help="Compare logs: each is identified by itself. A catalogue name, a URDF, or a robot YAML.",
            show_default=False,
        ),
    ] = None,
    mapping: MappingOption = None,
    rate: RateOption = None,
    friction: Annotated[
        str, typer.Option(help="Friction model of logs: auto, polynomial or coulomb-viscous.")
    ] = "auto",
    false_alarms: Annotated[float, typer.Option(help="Probability of any false alarm among all tests.")] = 0.01,
    seed: SeedOption = 0,
    out: OutOption = Path("compared"),
    tip: TipOption = None,
    joints: JointsOption = None,
    lock: LockOption = None,
    png: PngOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Compares models of several runs, days or robots of one type.

    Says which differences are significant, and writes compare.json, a merged model.json and report.html.
    """
    console = Console(json=json, quiet=quiet)
    with console.working() as progress:
        from estimation import read_logs
        from estimation.comparisons import compare as run
        from estimation.comparisons import identify_runs, read_model_runs
        from oed.reports import save_comparison_report
        from robots.common.errors import InputError
        from robots.common.files import ResultFolder

        _require_kind(models, robot)
        with ResultFolder(out, force, names=["compare.json", "model.json", "report.html"]) as folder:
            if robot is None:
                if mapping is not None or rate is not None:
                    raise InputError(
                        "--mapping or --rate without --robot", remedy="it belongs to logs: give --robot as well"
                    )
                runs = read_model_runs(models)
            else:
                described = robot_from(robot, tip, joints, lock)
                logs = read_logs(models, n=described.n, mapping=with_rate(mapping, rate), joints=described.joint_names)
                runs = identify_runs(described, logs, friction=friction, seed=seed, progress=progress)
            result = run(runs, alpha=false_alarms)
            result.save(folder.path("model.json").parent)
            save_comparison_report(result, folder, png=png)
    console.result(f"{result.summary()}\nwritten to {out.resolve()}", result.to_dict())


def _require_kind(paths: list[Path], robot: str | None) -> None:
    """Refuses logs without a robot, and models with one.

    Raises:
        InputError: the kind of files does not suit the options.
    """
    from robots.common.errors import InputError

    for path in paths:
        is_model = path.suffix == ".json" or (path / "model.json").is_file()
        if robot is not None and is_model:
            raise InputError("is a model, but --robot is given", file=path, remedy="give logs, or leave out --robot")
        if robot is None and not is_model and path.exists():
            raise InputError(
                "is no model.json and no folder that holds one",
                file=path,
                remedy="to compare logs, give --robot; else identify them first with oed identify",
            )
