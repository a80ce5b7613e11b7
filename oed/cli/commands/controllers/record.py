"""Records the feedback of a robot controller into a log.

Ctrl-C ends the recording.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from oed.cli.options.results import Overwriting
from oed.cli.options.robots import RobotOptions
from oed.cli.verbs import Printed, Verb
from oed.controllers.options import Endpoint
from robots.common.options import Option
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Record(Verb):
    """``oed record``.

    Attributes:
        log: log file to write, .csv.
        duration: stop after so long [s]. Default: Ctrl-C.
        patience: longest silence of the controller before giving up [s].
        external_axes: the controller has axes behind those of the robot: they stay where they are.
    """

    function = "oed.record"
    examples = ("oed record --robot er3a --host 192.168.0.10 --log log.csv --duration 60",)

    robot: RobotOptions
    duration: float | None = None
    link: Annotated[Endpoint, Option(without=("motion_port",))]
    patience: float = 2.0
    external_axes: bool = False
    log: Annotated[Path, Option(section="Output")] = Path("log.csv")
    overwriting: Overwriting = Overwriting()

    def run(self, progress: Progress) -> Printed:
        """Records the feedback."""
        from oed.controllers import record
        from oed.controllers.interrupts import terminate_as_interrupt

        robot = self.robot.load()
        with terminate_as_interrupt():
            result = record(
                robot,
                self.link,
                self.log,
                duration=self.duration,
                patience=self.patience,
                external_axes=self.external_axes,
                force=self.overwriting.force,
                progress=progress,
            )
        return Printed(result.summary(), result.to_dict())
