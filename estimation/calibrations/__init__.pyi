"""Calibration of a robot's geometry from measured poses."""

from estimation.calibrations.calibrating import calibrate as calibrate
from estimation.calibrations.options import CalibrationOptions as CalibrationOptions
from estimation.calibrations.options import TableOptions as TableOptions
from estimation.calibrations.pose_tables import read_poses as read_poses
from estimation.calibrations.result import CalibratedParameter as CalibratedParameter
from estimation.calibrations.result import Calibration as Calibration
from estimation.calibrations.result import load_calibration as load_calibration
