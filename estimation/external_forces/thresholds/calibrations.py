"""Settings of the observer, learned from a healthy robot: error model, threshold and levels of the localisation."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimation.external_forces.localisation import Localiser
from estimation.external_forces.options import Velocity
from estimation.external_forces.residuals.filters import time_constant
from estimation.external_forces.residuals.signals import SETTLING
from estimation.external_forces.thresholds.alarm_rates import AlarmThreshold
from estimation.external_forces.thresholds.error_models import ErrorModel
from estimation.external_forces.thresholds.rate_checks import RateCheck
from robots.common.errors import InputError
from robots.common.files import existing_file

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Calibration:
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
        return SETTLING * self.constant

    def to_dict(self) -> dict[str, Any]:
        """Writes it as plain data."""
        return {
            "bandwidth_hz": self.bandwidth,
            "velocity": self.velocity,
            "period": self.period,
            "errors": self.errors.to_dict(),
            "threshold": asdict(self.threshold),
            "localiser": {
                "joint": self.localiser.joint.tolist(),
                "link": self.localiser.link.tolist(),
                "tool": self.localiser.tool,
            },
            "friction_square": self.friction_square.tolist(),
            "own_log": self.own,
            "rate_check": None if self.check is None else self.check.to_dict(),
        }

    @staticmethod
    def from_dict(data: Mapping[str, Any]) -> Calibration:
        """Reads what `to_dict` wrote.

        Raises:
            InputError: anything else.
        """
        try:
            levels, check = data["localiser"], data["rate_check"]
            return Calibration(
                bandwidth=float(data["bandwidth_hz"]),
                velocity=data["velocity"],
                period=float(data["period"]),
                errors=ErrorModel.from_dict(data["errors"]),
                threshold=AlarmThreshold(**data["threshold"]),
                localiser=Localiser(
                    joint=np.array(levels["joint"], dtype=float),
                    link=np.array(levels["link"], dtype=float),
                    tool=float(levels["tool"]),
                ),
                friction_square=np.array(data["friction_square"], dtype=float),
                own=bool(data["own_log"]),
                check=None if check is None else RateCheck.from_dict(check),
            )
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"no calibration of a force observer ({type(error).__name__}: {error})") from error


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
    try:
        data = json.loads(existing_file(file).read_text(encoding="utf-8"))
        found = Calibration.from_dict(data["calibration"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"holds no calibration of oed force ({type(error).__name__})", file=file, remedy="give a forces.json"
        ) from error
    except InputError as error:
        raise InputError(error.problem, file=file, remedy=error.remedy or "give a forces.json") from error
    if len(found.errors.level) != joints:
        raise InputError(f"a calibration of {len(found.errors.level)} joints", file=file, allowed=f"{joints}")
    return found
