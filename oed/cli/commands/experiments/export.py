"""Writes a trajectory file for a robot controller or a simulator."""

from __future__ import annotations

import warnings
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from oed.cli.options.results import Overwriting
from oed.cli.options.robots import FileRobot
from oed.cli.verbs import Printed, Verb
from oed.exports.options import ExportOptions
from robots.common.errors import AssumedValueWarning, InputError
from robots.common.options import Option
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Written(Overwriting):
    """The file that is written.

    Attributes:
        to: format: csv, ros, ros-goal, rosbag, mcap, moveit-limits, simple-message, urscript, kuka, abb,
            abb-egm, franka or franka-player.
        out: file to write. Default: beside the trajectory, with the format in its name; programs have their own name.
        degrees: ``csv``: angles in degrees; linear axes stay in metres.
        positions_only: ``csv``: only t and q1..qn.
        bare: ``csv``: the column names without the comment block above them.
    """

    to: str = "csv"
    out: Path | None = None
    degrees: Annotated[bool, Option(only=("csv",))] = False
    positions_only: Annotated[bool, Option(only=("csv",))] = False
    bare: Annotated[bool, Option(only=("csv",))] = False


@dataclass(frozen=True, kw_only=True)
class Export(Verb):
    """``oed export``.

    Attributes:
        trajectory: a trajectory.csv.
        period: sample period of the controller [s]. Default: see the page.
    """

    function = "oed.export_trajectory"
    examples = (
        "oed export experiment/trajectory.csv --degrees --positions-only --bare --out for_controller.csv",
        "oed export experiment/trajectory.csv --to ros-goal --out goal.yaml",
        "oed export experiment/trajectory.csv --to mcap --out planned.mcap",
        "oed export experiment/trajectory.csv --to urscript --period 0.008 --out excitation.script",
    )

    trajectory: Annotated[Path, Option(argument=True)]
    robot: FileRobot = FileRobot()
    period: float | None = None
    options: ExportOptions = ExportOptions()
    output: Written = Written()

    @property
    def use(self) -> str:
        """The format."""
        return self.output.to

    def refusal(self, names: Collection[str]) -> InputError:
        """Says that a choice of csv is one of csv alone."""
        return InputError(f"{', '.join(names)} with --to {self.output.to}", allowed="them with csv only")

    def run(self, progress: Progress) -> Printed:
        """Writes the file."""
        from oed.exports import CONTROLLER_FORMS, FORMS, read_trajectory, write_form
        from oed.exports.trajectory_checks import stated_collisions

        output, file = self.output, self.trajectory
        if output.to not in FORMS:
            raise InputError(f"--to {output.to}", allowed=", ".join(FORMS))
        suffix = ".csv" if output.to == "csv" else CONTROLLER_FORMS[output.to].suffixes[0]
        # Controllers look for a program in the file of its name.
        named = output.to != "csv" and CONTROLLER_FORMS[output.to].named
        stem = f"{file.stem}-{output.to}"
        if named:
            stem = self.options.name or CONTROLLER_FORMS[output.to].program
        target = output.out or file.with_name(f"{stem}{suffix}")
        motion, metadata = read_trajectory(file)
        collisions, proved = stated_collisions(metadata)
        if not proved:
            warnings.warn(f"{file}: {collisions} Do not play it.", AssumedValueWarning, stacklevel=1)
        # Only the trajectory file itself can be written without knowing whose joints move.
        unknown = output.to == "csv" and not self.robot.robot and not metadata.get("robot")
        described = None if unknown else self.robot.load_for(metadata, file)
        table = {"degrees": output.degrees, "positions_only": output.positions_only, "bare": output.bare}
        settings: dict[str, Any] = {"metadata": metadata, "file": file, "force": output.force, "table": table}
        motion = write_form(target, motion, described, output.to, period=self.period, options=self.options, **settings)
        has_samples = output.to == "csv" or CONTROLLER_FORMS[output.to].has_samples
        data = {
            "file": str(target),
            "form": output.to,
            "samples": len(motion) if has_samples else None,
            "joints": motion.n,
            "period": motion.period if has_samples else None,
            "collisions": collisions,
        }
        limits = "limits of velocity, acceleration and jerk" if output.to == "moveit-limits" else "a program"
        content = f"{len(motion)} samples" if has_samples else limits
        return Printed(f"{content} of {motion.n} joints written to {target}", data)
