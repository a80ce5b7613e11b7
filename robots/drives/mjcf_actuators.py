"""Control laws that an MJCF's actuators state: position, velocity and general ones of the same form."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from robots.common.errors import InputError
from robots.mujoco_models.actuators import FIXED_GAIN, actuators_of
from robots.mujoco_models.elements import HINGE, SLIDE, MujocoNames
from robots.mujoco_models.files import compile_mjcf, mujoco_library

AFFINE = 1  # mjtBias
ROUNDING = 1e-9


class MjcfLaw(NamedTuple):
    """The law of one joint: its name, and values by parameter."""

    law: str
    values: dict[str, float]


def read_actuators(path: Path) -> dict[str, MjcfLaw]:
    """Reads the laws of an MJCF's joints.

    A position actuator, and a general one of fixed gain and affine bias, is PD control in torque. A velocity actuator
    is a velocity loop. Motors have no law.

    Args:
        path: the file.

    Returns:
        The laws by the joints' names, of joints that have one.

    Raises:
        InputError: MuJoCo is not installed or refuses the file; or several actuators with a law on one joint.
    """
    library, model = mujoco_library(path), compile_mjcf(path, warn=False)
    names = MujocoNames(library, model)
    found: dict[str, MjcfLaw] = {}
    for joint in range(model.njnt):
        if model.jnt_type[joint] not in (SLIDE, HINGE):
            continue
        laws = [law for a, gear in actuators_of(model, joint) if (law := _law(model, a, gear)) is not None]
        if len(laws) > 1:
            raise InputError(f"{len(laws)} actuators with a control law", file=path, joint=names.joints[joint])
        if laws:
            found[names.joints[joint]] = laws[0]
    return found


def _law(model: Any, actuator: int, gear: float) -> MjcfLaw | None:
    if model.actuator_gaintype[actuator] != FIXED_GAIN or model.actuator_biastype[actuator] != AFFINE:
        return None
    gain, bias = float(model.actuator_gainprm[actuator, 0]), np.asarray(model.actuator_biasprm[actuator])[:3]
    limits: dict[str, float] = {}
    if model.actuator_forcelimited[actuator]:
        limits["torque_limit"] = float(np.min(np.abs(model.actuator_forcerange[actuator]))) * abs(gear)
    late = getattr(model, "actuator_delay", None)
    if late is not None and float(late[actuator]) > 0:
        limits["delay"] = float(late[actuator])
    scale = max(abs(gain), 1.0) * ROUNDING
    if gain > 0 and abs(gain + bias[1]) <= scale:
        return MjcfLaw("pd", {"kp": gain * gear**2, "kd": -float(bias[2]) * gear**2, **limits})
    if gain > 0 and bias[1] == 0 and abs(gain + bias[2]) <= scale:
        return MjcfLaw("velocity", {"kv": gain * gear**2, **limits})
    return None
