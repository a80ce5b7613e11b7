"""MoveIt's joint_limits.yaml: velocity, acceleration and jerk limits of the robot."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
import yaml

from oed.exports.forms.base import Array, ExportOptions, Form
from robots.common.errors import InputError
from robots.robot import Robot
from robots.signals import Motion

QUANTITIES = ("velocity", "acceleration", "jerk")


class MoveItLimits(Form):
    """The limits of the robot that a trajectory is of; the trajectory itself is not in the file."""

    name: ClassVar[str] = "moveit-limits"
    suffixes: ClassVar[tuple[str, ...]] = (".yaml",)
    has_samples: ClassVar[bool] = False

    def write(self, motion: Motion, robot: Robot, options: ExportOptions, suffix: str) -> bytes:
        """See `Form.write`."""
        joints: dict[str, Any] = {}
        for joint, name in enumerate(robot.joint_names):
            entry: dict[str, Any] = {}
            for quantity in QUANTITIES:
                limit = float(getattr(robot.limits, quantity)[joint])
                entry[f"has_{quantity}_limits"] = bool(np.isfinite(limit))
                if np.isfinite(limit):
                    entry[f"max_{quantity}"] = limit
            joints[name] = entry
        factors = {"default_velocity_scaling_factor": 1.0, "default_acceleration_scaling_factor": 1.0}
        return yaml.safe_dump(factors | {"joint_limits": joints}, sort_keys=False).encode()


def read_joint_limits(content: bytes, robot: Robot) -> dict[str, Array]:
    """Reads velocity, acceleration and jerk limits (n,) from a joint_limits.yaml; infinite where there is none.

    Args:
        content: of the file.
        robot: whose joints are looked up by name.

    Raises:
        InputError: another content, a joint that is missing, or a limit that is no positive number.
    """
    try:
        joints = yaml.safe_load(content)["joint_limits"]
    except (yaml.YAMLError, KeyError, TypeError) as error:
        raise InputError(f"no joint_limits ({error})", allowed="MoveIt's joint_limits.yaml") from error
    found = {quantity: np.full(robot.n, np.inf) for quantity in QUANTITIES}
    for joint, name in enumerate(robot.joint_names):
        if not isinstance(joints, dict) or not isinstance(joints.get(name), dict):
            raise InputError(f"no limits of {name}", joint=joint + 1, remedy=f"add {name} to joint_limits")
        for quantity in QUANTITIES:
            if not joints[name].get(f"has_{quantity}_limits", False):
                continue
            value = joints[name].get(f"max_{quantity}")
            if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < float("inf"):
                raise InputError(f"max_{quantity} is {value!r}", joint=joint + 1, allowed="a positive number")
            found[quantity][joint] = value
    return found
