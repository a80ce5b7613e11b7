"""Retimes a trajectory, or times a list of waypoints, within the robot's limits.

Writes trajectory.csv, design.json and report.html.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from oed.cli.options.models import Planned
from oed.cli.options.motions import Collisions
from oed.cli.options.results import Folder
from oed.cli.options.robots import FileRobot
from oed.cli.verbs import Printed, Verb
from robots.common.errors import InputError
from robots.common.options import Option
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Retime(Verb):
    """``oed retime``.

    Attributes:
        trajectory: a trajectory.csv, or a CSV of waypoints: q1..qn without t.
        method: method: toppra follows the path exactly; ruckig replaces it by straight lines and stops at their
            corners.
        criterion: criterion to report before and after: cond, d, a, e or cond-d.
        tolerance: largest allowed deviation of ruckig's straight lines from the path [rad].
    """

    function = "oed.retime"
    examples = (
        "oed retime experiment/trajectory.csv --method toppra --out retimed",
        "oed retime waypoints.csv --robot er3a --out timed",
    )

    trajectory: Annotated[Path, Option(argument=True)]
    method: str = "toppra"
    robot: FileRobot = FileRobot()
    criterion: Annotated[str, Option(choices="oed.criteria:CRITERIA")] = "cond"
    model: Planned = Planned()
    tolerance: float = 0.01
    collisions: Collisions = Collisions()
    output: Folder = Folder(out=Path("retimed"))

    def run(self, progress: Progress) -> Printed:
        """Retimes the path."""
        from oed import read_trajectory, retime
        from oed.experiments.retiming import move_with_stops
        from oed.exports import read_waypoints

        with self.output.opened("trajectory.csv", "design.json", "report.html") as folder:
            robot = self.robot.load() if self.robot.robot else None
            points = read_waypoints(self.trajectory, robot=robot)
            if points is None:
                motion, metadata = read_trajectory(self.trajectory)
                if robot is None and metadata.get("robot"):
                    robot = self.robot.load(str(metadata["robot"]))
            if robot is None:
                raise InputError("the file does not name its robot", file=self.trajectory, remedy="give --robot")
            if points is not None:
                motion = move_with_stops(robot, points)
            progress.start(f"retiming by {self.method}", None)
            result = retime(
                robot,
                motion if points is None else points,
                method=self.method,
                criterion=self.criterion,
                friction=self.model.friction,
                tolerance=self.tolerance,
                collision=self.collisions.collision,
                surroundings=self.collisions.surroundings(),
            )
            self.output.save(folder, result, given=motion)
        return self.output.printed(result)
