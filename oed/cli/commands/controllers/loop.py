"""Designs and plays experiments until the diagnosis leaves nothing ambiguous.

Each experiment is played on the robot controller, recorded, identified and diagnosed. The next one separates the
causes that are still open. After an interruption the same command goes on. Writes loop.json, diagnosis.json,
model.json, report.html, and a folder for each experiment.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

from oed.campaigns.loops.options import LoopOptions
from oed.cli.options.motions import Obstacles
from oed.cli.options.results import Folder
from oed.cli.options.robots import PlannedRobot
from oed.cli.options.work import Processes
from oed.cli.verbs import Printed, Verb
from oed.controllers.options import OF_STREAM, Endpoint, StreamOptions
from robots.common.options import Option
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Loop(Verb):
    """``oed loop``.

    Attributes:
        design: folder of an `oed design` result for the first experiment. Default: one is designed.
    """

    function = "oed.run_loop"
    examples = (
        "oed loop --robot er3a --host 192.168.0.10 --out loop",
        "oed loop --robot er3a --host 127.0.0.1 --design experiment --experiments 3 --out loop",
    )

    robot: PlannedRobot
    options: LoopOptions
    obstacles: Obstacles = Obstacles()
    design: Path | None = None
    work: Processes = Processes()
    link: Endpoint
    streaming: Annotated[StreamOptions, Option(without=OF_STREAM)]
    output: Folder = Folder(out=Path("loop"))

    def kept(self) -> str:
        """Says that the robot stops."""
        return "the robot was ordered to stop; the same command goes on"

    def run(self, progress: Progress) -> Printed:
        """Makes the experiments."""
        from oed.campaigns.loops import run_loop
        from oed.controllers.interrupts import terminate_as_interrupt
        from oed.reports import save_report
        from robots.common.files import ResultFolder

        robot, output = self.robot.load(), self.output
        with self.work.executor() as executor, terminate_as_interrupt():
            result = run_loop(
                robot,
                self.link,
                output.out,
                design=self.design,
                options=replace(self.options, surroundings=self.obstacles.surroundings()),
                stream_options=self.streaming,
                speed=self.streaming.speed,
                workers=self.work.workers,
                executor=executor,
                force=output.force,
                report=save_report,
                progress=progress,
            )
        with ResultFolder(output.out, True, names=["report.html"]) as folder:
            save_report(result, folder, png=output.png)
        return replace(output.printed(result), code=0 if result.success else 1)
