"""Calibrates a robot's geometry from measured poses: joint zeros, links, base and tool.

Writes calibration.json, report.html, the corrected robot as robot.urdf, robot.xml and robot.yaml, both
Denavit-Hartenberg tables, and joint_zeros.yaml.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from estimation.calibrations.options import CalibrationOptions, TableOptions
from oed.cli.options.models import model_for
from oed.cli.options.results import Folder
from oed.cli.options.robots import Chain, SimulatedRobot
from oed.cli.verbs import Printed, Verb
from robots.common.options import Option
from robots.common.progress import Progress

if TYPE_CHECKING:
    from robots.geometry_errors import MeasuredPoses
    from robots.robot import Robot

FILES = (
    *("calibration.json", "report.html", "robot.urdf", "robot.xml", "robot.yaml"),
    *("dh_modified.csv", "dh_standard.csv", "joint_zeros.yaml"),
)


@dataclass(frozen=True, kw_only=True)
class Calibrate(Verb):
    """``oed calibrate``.

    Attributes:
        poses: a table of measured poses (CSV or Parquet).
        held_out: poses of another session, to check the result on.
        second: the second arm, for a part that both arms hold.
        camera_stands: the camera stands, and the board is on the flange.
        model: a model.json of the robot: its torque of gravity bends the joints, not that of the description.
        check: refuse poses in other units, orders or frames than stated, and lost markers.
    """

    function = "estimation.calibrate"
    examples = (
        "oed calibrate --robot arm.urdf --poses poses.csv --out calibrated",
        "oed calibrate --robot ur10 --poses poses.csv --lengths mm --angles deg --held-out other.csv --out calibrated",
    )

    robot: SimulatedRobot
    second: Annotated[str | None, Option(section="Robot", names_file=True)] = None
    poses: Path
    held_out: Path | None = None
    model: Path | None = None
    table: TableOptions = TableOptions()
    camera_stands: bool = False
    check: bool = True
    options: CalibrationOptions = CalibrationOptions()
    output: Folder = Folder(out=Path("calibrated"))

    def run(self, progress: Progress) -> Printed:
        """Calibrates the robot."""
        from estimation import calibrate
        from estimation.calibrations.exports.files import calibrated_files

        with self.output.opened(*FILES) as folder:
            arms = [self.robot.load()]
            if self.second is not None:
                arms.append(Chain().load(self.second))
            measured = self._read(self.poses, arms)
            other = None if self.held_out is None else self._read(self.held_out, arms)
            result = calibrate(arms, measured, held_out=other, options=self.options, progress=progress)
            self.output.save(folder, result)
            for name, text in calibrated_files(result).items():
                folder.path(name).write_text(text, encoding="utf-8")
        return self.output.printed(result, without=("poses", "robot", "corrected"))

    def _read(self, path: Path, arms: list[Robot]) -> MeasuredPoses:
        """Reads poses, with the torque of gravity of the model if one is named."""
        import numpy as np

        from estimation import read_poses

        how = replace(self.table, camera_on_flange=not self.camera_stands)
        poses = read_poses(path, arms, options=how, checked=self.check)
        if self.model is None:
            return poses
        model, still = model_for(self.model, poses.q.shape[1]), np.zeros_like(poses.q)
        return replace(poses, torque=-np.asarray(model.torque(poses.q, still, still)))
