"""Writes a page with the robot in 3-D, which plays a trajectory or a log.

The page needs no network. Limits light up as the motion approaches them.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from oed.cli.options.logs import Columns
from oed.cli.options.results import Overwriting
from oed.cli.options.robots import FileRobot
from oed.cli.verbs import Printed, Verb
from robots.common.errors import OtherRobotWarning
from robots.common.options import Option
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Page(Overwriting):
    """The page that is written.

    Attributes:
        out: HTML file to write.
    """

    out: Path = Path("robot.html")


@dataclass(frozen=True, kw_only=True)
class Show(Verb):
    """``oed show``.

    Attributes:
        motion: a trajectory.csv, or a log.
        diagnosis: a diagnosis.json, or its folder: joints with a finding are marked.
    """

    function = "oed.reports.animate"
    examples = (
        "oed show experiment/trajectory.csv --out robot.html",
        "oed show log.csv --robot er3a --diagnosis diagnosed --out robot.html",
    )

    motion: Annotated[Path, Option(argument=True)]
    robot: FileRobot = FileRobot()
    columns: Columns = Columns()
    diagnosis: Path | None = None
    page: Page = Page()

    def run(self, progress: Progress) -> Printed:
        """Writes the page."""
        from oed.exports import is_made_for, read_trajectory
        from oed.exports.trajectory_csv import is_trajectory
        from oed.reports import animate, motion_page, render
        from oed.reports.pages.motions.diagnosis_motion import marked_findings
        from oed.reports.rendering.provenance import recordings_from
        from robots.common.files import existing_file, open_atomic
        from robots.signals import Log, Motion

        out, motion, columns = self.page.out, self.motion, self.columns
        # Opened before the work: an existing file ends the command early, and an error leaves no file behind.
        with open_atomic(out, force=self.page.force) as page_file:
            existing_file(motion)
            planned = columns.mapping is None and columns.rate is None and is_trajectory(motion)
            played: Motion | Log
            stated: dict[str, Any] = {}
            if planned:
                played, stated = read_trajectory(motion)
            described = self.robot.load_for(stated, motion)
            made_for = str(stated.get("robot") or described.name)
            if not is_made_for(made_for, described):
                text = f"{motion.name} was made for {made_for}; {described.name} is used (--robot)"
                warnings.warn(OtherRobotWarning(text), stacklevel=1)
            if not planned:
                (played,) = columns.read([motion], described, torque=False)
            marks, findings = marked_findings(self.diagnosis, described) if self.diagnosis else ({}, ())
            animation = animate(described, played, marks=marks)
            logs = recordings_from([played]) if isinstance(played, Log) else ()
            page_file.write(render(motion_page(animation, logs=logs, findings=findings)).encode())
        margins = [
            {"quantity": m.quantity, "joint": m.joint, "slack_fraction": m.slack_fraction, "time": m.time}
            for m in animation.approaches
        ]
        data = {
            "file": str(out),
            "robot": described.name,
            "duration": animation.duration,
            "bodies": len(animation.bodies),
            "marked_joints": sorted(animation.marks),
            "closest_approaches": margins,
        }
        return Printed(f"{animation.summary()}\nwritten to {out}", data)
