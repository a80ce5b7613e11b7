"""Designs experiments on the Pareto front of several criteria.

Writes pareto.json, report.html and one folder for each design.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from oed.cli.options.models import Planned
from oed.cli.options.motions import Collisions, Excitation
from oed.cli.options.results import Folder
from oed.cli.options.robots import PlannedRobot
from oed.cli.options.work import Processes
from oed.cli.verbs import Printed, Verb
from robots.common.options import Option, Seed, names
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Pareto(Verb):
    """``oed pareto``.

    Attributes:
        criteria: two or three of cond, d, a, e, comma-separated.
        points: number of designs between two criteria, both ends included.
        scaling: column scaling of the regressor in the criteria: none, nominal or unit.
        effort: search effort for each design: quick, standard or thorough.
        seed: seed of the random numbers.
    """

    function = "oed.pareto"
    examples = ("oed pareto --robot er3a --criteria cond,d --points 5 --out pareto",)

    robot: PlannedRobot
    criteria: Annotated[tuple[str, ...], Option(reads=names)] = ("cond", "d")
    points: int = 5
    model: Planned = Planned()
    excitation: Excitation = Excitation()
    collisions: Collisions = Collisions()
    scaling: str = "none"
    effort: str = "quick"
    seed: Seed = 0
    work: Processes = Processes()
    output: Folder = Folder(out=Path("pareto"))

    def run(self, progress: Progress) -> Printed:
        """Designs the experiments."""
        from oed import LimitOptions, ModelOptions, SearchOptions, TrajectoryOptions, WeightOptions, pareto
        from oed.reports import save_pareto_report

        workers, avoided = self.work.workers, self.collisions
        with self.work.executor() as executor, self.output.opened("pareto.json", "report.html") as folder:
            front = pareto(
                self.robot.load(),
                criteria=self.criteria,
                points=self.points,
                model=ModelOptions(friction=self.model.friction),
                trajectory=TrajectoryOptions(family=self.excitation.chosen()),
                limits=LimitOptions(collision=avoided.collision, surroundings=avoided.surroundings()),
                weights=WeightOptions(scaling=self.scaling),
                search=SearchOptions(effort=self.effort, seed=self.seed, workers=workers, executor=executor),
                progress=progress,
            )
            front.save(folder.path("pareto.json").parent)
            save_pareto_report(front, folder, png=self.output.png)
        return self.output.printed(front)
