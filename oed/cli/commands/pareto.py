"""``oed pareto``: designs that trade several criteria off."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from oed.cli.console import Console
from oed.cli.options import (
    BaseFrequencyOption,
    ClusterOption,
    CollisionOption,
    FamilyOption,
    FloorOption,
    ForceOption,
    FrictionOption,
    HarmonicsOption,
    JsonOption,
    KeepOutOption,
    NoFloorOption,
    OutOption,
    PngOption,
    QuietOption,
    RobotOption,
    SeedOption,
    UnlimitedOption,
    WorkersOption,
    executor_from,
    robot_from,
)


def pareto(
    robot: RobotOption,
    criteria: Annotated[str, typer.Option(help="Two or three of cond, d, a, e, comma-separated.")] = "cond,d",
    points: Annotated[int, typer.Option(help="Number of designs between two criteria, both ends included.")] = 5,
    friction: FrictionOption = "polynomial",
    family: FamilyOption = "fourier",
    harmonics: HarmonicsOption = 5,
    base_frequency: BaseFrequencyOption = 0.1,
    collision: CollisionOption = True,
    floor: FloorOption = None,
    no_floor: NoFloorOption = False,
    keep_out: KeepOutOption = None,
    scaling: Annotated[
        str, typer.Option(help="Column scaling of the regressor in the criteria: none, nominal or unit.")
    ] = "none",
    effort: Annotated[str, typer.Option(help="Search effort for each design: quick, standard or thorough.")] = "quick",
    seed: SeedOption = 0,
    workers: WorkersOption = None,
    cluster: ClusterOption = None,
    out: OutOption = Path("pareto"),
    png: PngOption = False,
    unlimited: UnlimitedOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Designs experiments on the Pareto front of several criteria.

    Writes pareto.json, report.html and one folder for each design.
    """
    console = Console(json=json, quiet=quiet)
    with console.working() as progress:
        from oed.cli.spaces import surroundings_from
        from oed.experiments import LimitOptions, ModelOptions, SearchOptions, TrajectoryOptions, WeightOptions
        from oed.experiments import pareto as run
        from oed.reports import save_pareto_report
        from oed.trajectories import family as choose_family
        from robots.common.files import ResultFolder

        with (
            executor_from(workers, cluster) as executor,
            ResultFolder(out, force, names=["pareto.json", "report.html"]) as folder,
        ):
            front = run(
                robot_from(robot, unlimited=unlimited),
                criteria=[name.strip() for name in criteria.split(",")],
                points=points,
                model=ModelOptions(friction=friction),
                trajectory=TrajectoryOptions(
                    family=choose_family(family, harmonics=harmonics, base_frequency=base_frequency)
                ),
                limits=LimitOptions(collision=collision, surroundings=surroundings_from(floor, no_floor, keep_out)),
                weights=WeightOptions(scaling=scaling),
                search=SearchOptions(effort=effort, seed=seed, workers=workers, executor=executor),
                progress=progress,
            )
            front.save(folder.path("pareto.json").parent)
            save_pareto_report(front, folder, png=png)
    console.result(f"{front.summary()}\nwritten to {out.resolve()}", front.to_dict())
