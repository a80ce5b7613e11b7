"""``oed pareto``: designs between the extremes of several criteria."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from oed.cli.console import Console
from oed.cli.options import (
    ForceOption,
    JsonOption,
    PngOption,
    QuietOption,
    RobotOption,
    SeedOption,
    WorkersOption,
    robot_from,
)


def pareto(
    robot: RobotOption,
    criteria: Annotated[str, typer.Option(help="Two or three of cond, d, a, e, separated by commas.")] = "cond,d",
    points: Annotated[int, typer.Option(help="Designs from one criterion to another, both ends included.")] = 5,
    friction: Annotated[str, typer.Option(help="The model to fit: polynomial or coulomb-viscous.")] = "polynomial",
    harmonics: Annotated[int, typer.Option(help="Harmonics of the Fourier series.")] = 5,
    base_frequency: Annotated[float, typer.Option(help="Frequency of the first harmonic [Hz].")] = 0.1,
    collision: Annotated[
        bool, typer.Option("--collision", help="Keep clear of the arm itself and of the obstacles in its file.")
    ] = False,
    scaling: Annotated[str, typer.Option(help="Columns the criteria judge: none, nominal or unit.")] = "none",
    effort: Annotated[str, typer.Option(help="How long to search for each: quick, standard or thorough.")] = "quick",
    seed: SeedOption = 0,
    workers: WorkersOption = None,
    out: Annotated[Path, typer.Option("--out", help="Folder for the results.")] = Path("pareto"),
    png: PngOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Designs for several criteria at once: pareto.json, report.html and a folder for each design."""
    console = Console(json=json, quiet=quiet)
    with console.working() as progress:
        from oed.experiments import pareto as run
        from oed.reports import save_pareto_report
        from robots.common.files import ResultFolder

        with ResultFolder(out, force, names=["pareto.json", "report.html"]) as folder:
            front = run(
                robot_from(robot),
                criteria=[name.strip() for name in criteria.split(",")],
                points=points,
                friction=friction,
                harmonics=harmonics,
                base_frequency=base_frequency,
                collision=collision,
                scaling=scaling,
                effort=effort,
                seed=seed,
                workers=workers,
                progress=progress,
            )
            front.save(folder.path("pareto.json").parent)
            save_pareto_report(front, folder, png=png)
    console.result(f"{front.summary()}\nwritten to {out.resolve()}", front.to_dict())
