"""A calibrated robot as files: URDF, MJCF, Denavit-Hartenberg tables and joint zeros."""

from estimation.calibrations.exports.robot_files import calibrated_mjcf, calibrated_urdf, calibrated_yaml
from estimation.calibrations.exports.tables import dh_text, zeros_text

__all__ = ["calibrated_mjcf", "calibrated_urdf", "calibrated_yaml", "dh_text", "zeros_text"]
