"""Plays a trajectory on a robot controller by simple_message, RTDE or EGM.

Records the feedback into a log.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from oed.cli.options.motions import Obstacles
from oed.cli.options.results import Overwriting
from oed.cli.options.robots import FileRobot
from oed.cli.verbs import Printed, Verb
from oed.controllers.options import Endpoint, StreamOptions
from robots.common.options import Option
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Stream(Verb):
    """``oed stream``.

    Attributes:
        trajectory: a trajectory.csv.
        log: log file to write, .csv.
        period: time between two points [s]. Default: that of the trajectory.
        collision: refuse a trajectory that collides with the robot itself, the floor or the obstacles in the robot
            file.
        dry_run: check trajectory, controller and pose; only listen.
    """

    function = "oed.stream"
    examples = (
        "oed stream experiment/trajectory.csv --host 192.168.0.10 --dry-run",
        "oed stream experiment/trajectory.csv --host 192.168.0.10 --log log.csv",
    )

    trajectory: Annotated[Path, Option(argument=True)]
    robot: FileRobot = FileRobot()
    link: Endpoint
    options: Annotated[StreamOptions, Option(without=("speed",))]
    period: float | None = None
    dry_run: bool = False
    collision: bool = True
    obstacles: Obstacles = Obstacles()
    log: Annotated[Path, Option(section="Output")] = Path("log.csv")
    overwriting: Overwriting = Overwriting()

    def kept(self) -> str:
        """Says where the feedback is."""
        if self.log.exists() and not self.dry_run:
            return f"the robot was ordered to stop; the feedback up to here is in {self.log}"
        return "no point was sent"

    def run(self, progress: Progress) -> Printed:
        """Plays the trajectory."""
        from oed.controllers import stream
        from oed.controllers.interrupts import terminate_as_interrupt
        from oed.experiments.safety_checks.freedom import require_free
        from oed.exports import check_trajectory, read_trajectory
        from oed.exports.forms.sampling import at_period
        from oed.exports.trajectory_checks import stated_collisions
        from robots.collision import Surroundings

        file = self.trajectory
        motion, metadata = read_trajectory(file)
        if self.period is not None:
            motion = at_period(motion, self.period)
        robot, around = self.robot.load_for(metadata, file), self.obstacles.surroundings()
        # What a design has proved need not be proved again, unless other surroundings are stated.
        proved = stated_collisions(metadata)[1] and around == Surroundings()
        check_trajectory(motion, robot, metadata, file)
        if self.collision and not proved:
            require_free(around.model(robot), motion, file)
        with terminate_as_interrupt():
            result = stream(
                motion,
                robot,
                self.link,
                log=None if self.dry_run else self.log,
                options=self.options,
                metadata=metadata,
                file=file,
                dry_run=self.dry_run,
                force=self.overwriting.force,
                progress=progress,
            )
        return Printed(result.summary(), result.to_dict())
