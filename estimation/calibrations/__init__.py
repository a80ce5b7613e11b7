"""Calibration of a robot's geometry from measured poses."""

from estimation.calibrations.calibrating import CalibrationOptions, calibrate
from estimation.calibrations.pose_tables import TableOptions, read_poses
from estimation.calibrations.result import CalibratedParameter, Calibration, load_calibration

__all__ = [
    "CalibratedParameter",
    "Calibration",
    "CalibrationOptions",
    "TableOptions",
    "calibrate",
    "load_calibration",
    "read_poses",
]
