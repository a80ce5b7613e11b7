"""Settings of the observer, learned from a healthy robot: error model, threshold and levels of the localisation."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from estimation.external_forces.localisation import Localiser
from estimation.external_forces.options import Velocity
from estimation.external_forces.residuals.filters import time_constant
from estimation.external_forces.residuals.signals import SETTLING_CONSTANTS
from estimation.external_forces.thresholds.alarm_rates import AlarmThreshold
from estimation.external_forces.thresholds.error_models import ErrorModel
from estimation.external_forces.thresholds.rate_checks import RateCheck
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.records import Record, read_json


@dataclass(frozen=True, kw_only=True, eq=False)
class Calibration(Record):
    """Settings of the observer, learned from a healthy robot.

    Attributes:
        bandwidth: of the observer [Hz].
        velocity: what velocities it was learned with.
        period: usual sample period of the healthy logs [s].
        errors: standard deviation of the residual by the motion.
        threshold: of the squared distance of the residual from zero.
        localiser: levels from which joints react.
        friction_square: mean square of each joint's friction (n,) [(N m)^2].
        own: whether the log itself served, without its contacts.
        check: of the threshold's rate by parts of the healthy logs; None where the log itself served.
    """

    ENTRIES = (
        "bandwidth_hz=bandwidth",
        "velocity",
        "period",
        "errors",
        "threshold",
        "localiser",
        "friction_square",
        "own_log=own",
        "rate_check=check",
    )

    bandwidth: float
    velocity: Velocity
    period: float
    errors: ErrorModel
    threshold: AlarmThreshold
    localiser: Localiser
    friction_square: Array
    own: bool = False
    check: RateCheck | None = None

    @property
    def constant(self) -> float:
        """Time constant of the observer [s]."""
        return time_constant(self.bandwidth)

    @property
    def memory(self) -> float:
        """Time after which the observer has forgotten a contact [s]: exceedances closer than this are one contact."""
        return SETTLING_CONSTANTS * self.constant


def read_calibration(path: str | Path, joints: int) -> Calibration:
    """Reads the calibration in a ``forces.json``, or in the folder that holds one.

    Args:
        path: the file or its folder.
        joints: of the robot.

    Raises:
        InputError: no such file, another content, or a calibration of another number of joints.
    """
    file = Path(path)
    file = file / "forces.json" if file.is_dir() else file
    remedy = "give a forces.json"
    data = read_json(file, remedy=remedy)
    if "calibration" not in data:
        raise InputError("holds no calibration of oed force", file=file, remedy=remedy)
    found = Calibration.from_dict(data["calibration"], file=file, remedy=remedy)
    if len(found.errors.level) != joints:
        raise InputError(f"a calibration of {len(found.errors.level)} joints", file=file, allowed=f"{joints}")
    return found
