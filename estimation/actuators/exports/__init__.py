"""Identified drives as files of simulators: MuJoCo, Isaac Lab, Newton, and a URDF's dynamics."""

from __future__ import annotations

from estimation.actuators.exports.configurations import isaac_lab_text, newton_text
from estimation.actuators.exports.expressible import Expressible, expressible
from estimation.actuators.exports.files import SimulatorFiles, simulator_files
from estimation.actuators.exports.mjcf import drives_mjcf
from estimation.actuators.exports.urdf import drives_urdf

__all__ = [
    "Expressible",
    "SimulatorFiles",
    "drives_mjcf",
    "drives_urdf",
    "expressible",
    "isaac_lab_text",
    "newton_text",
    "simulator_files",
]
