"""All files of a calibrated robot."""

from __future__ import annotations

from estimation.calibrations.exports.robot_files import calibrated_mjcf, calibrated_urdf, calibrated_yaml
from estimation.calibrations.exports.tables import dh_text, zeros_text
from estimation.calibrations.result import Calibration


def calibrated_files(result: Calibration) -> dict[str, str]:
    """Writes the corrected robot in all forms.

    Args:
        result: of a calibration.

    Returns:
        Texts by file name; a form that cannot state the robot is left out.
    """
    texts = {
        "robot.urdf": calibrated_urdf(result),
        "robot.xml": calibrated_mjcf(result),
        "robot.yaml": calibrated_yaml(result, "robot.urdf"),
        "dh_modified.csv": dh_text(result, "modified"),
        "dh_standard.csv": dh_text(result, "standard"),
        "joint_zeros.yaml": zeros_text(result),
    }
    return {name: text for name, text in texts.items() if text is not None}
