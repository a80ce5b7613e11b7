"""All files of simulators together, and what they do not state."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from estimation.actuators.exports.configurations import isaac_lab_text, newton_text
from estimation.actuators.exports.expressible import expressible
from estimation.actuators.exports.mjcf import drives_mjcf
from estimation.actuators.exports.urdf import drives_urdf
from estimation.actuators.result import Actuators
from robots.common.errors import InputError
from robots.geometry.xacro_ import is_description


class SimulatorFiles(NamedTuple):
    """Texts by the names of their files, and remarks."""

    files: dict[str, str]
    remarks: tuple[str, ...]


def simulator_files(result: Actuators, folder: Path) -> SimulatorFiles:
    """Writes identified drives for MuJoCo, Isaac Lab and Newton, and for a URDF its dynamics.

    Args:
        result: identified drives.
        folder: into which the files will be written.
    """
    known = expressible(result)
    files = {"isaac_lab.py": isaac_lab_text(result), "newton.json": newton_text(result)}
    remarks = [f"simulators cannot state: {text}" for text in known.left_out]
    try:
        files["drives.xml"] = drives_mjcf(result, folder).text
    except InputError as error:
        remarks.append(f"no drives.xml: {error}")
    if result.robots and is_description(result.robots[0].origin):
        files["drives.urdf"] = drives_urdf(result)
    return SimulatorFiles(files, tuple(remarks))
