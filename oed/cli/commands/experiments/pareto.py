"""Designs experiments on the Pareto front of several criteria.

Writes pareto.json, report.html and one folder for each design.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

from oed.cli.options.motions import Excitation, Obstacles
from oed.cli.options.results import Folder
from oed.cli.options.robots import PlannedRobot
from oed.cli.options.work import Processes
from oed.cli.verbs import Printed, Verb
from oed.experiments.options import LimitOptions, ModelOptions, SearchOptions, TrajectoryOptions, WeightOptions
from robots.common.options import Option, names
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Pareto(Verb):
    """``oed pareto``.

    Attributes:
        criteria: two or three of cond, d, a, e, comma-separated.
        points: number of designs between two criteria, both ends included.
    """

    function = "oed.pareto"
    examples = ("oed pareto --robot er3a --criteria cond,d --points 5 --out pareto",)

    robot: PlannedRobot
    criteria: Annotated[tuple[str, ...], Option(reads=names)] = ("cond", "d")
    points: int = 5
    model: ModelOptions = ModelOptions()
    excitation: Excitation = Excitation()
    trajectory: TrajectoryOptions
    limits: LimitOptions
    obstacles: Obstacles = Obstacles()
    weights: WeightOptions = WeightOptions()
    search: Annotated[SearchOptions, Option(defaults=(("effort", "quick"),))]
    work: Processes = Processes()
    output: Folder = Folder(out=Path("pareto"))

    def run(self, progress: Progress) -> Printed:
        """Designs the experiments."""
        from oed import pareto

        workers = self.work.workers
        with self.work.executor() as executor, self.output.opened("pareto.json", "report.html") as folder:
            front = pareto(
                self.robot.load(),
                criteria=self.criteria,
                points=self.points,
                model=self.model,
                trajectory=replace(self.trajectory, family=self.excitation.chosen()),
                limits=replace(self.limits, surroundings=self.obstacles.surroundings()),
                weights=self.weights,
                search=replace(self.search, workers=workers, executor=executor),
                progress=progress,
            )
            self.output.save(folder, front)
        return self.output.printed(front)
