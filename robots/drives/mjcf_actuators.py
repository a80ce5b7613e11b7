"""Control laws that an MJCF's actuators state: position, velocity and general ones of the same form."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from robots.common.errors import InputError
from robots.mujoco_models.actuators import FIXED_GAIN, actuators_of, control_of
from robots.mujoco_models.elements import HINGE, SLIDE, MujocoNames
from robots.mujoco_models.files import compile_mjcf, mujoco_library

AFFINE = 1  # mjtBias
ROUNDING = 1e-9
NEAR, FAR, HUGE = 1e-6, 1e9, 1e5
"""Changes [rad or rad/s] by which MuJoCo is asked for a law, a command that saturates, and no limit [N m]."""


class MjcfLaw(NamedTuple):
    """The law of one joint: its name, and values by parameter."""

    law: str
    values: dict[str, float]


def read_actuators(path: Path) -> dict[str, MjcfLaw]:
    """Reads the laws of an MJCF's joints.

    A position actuator, and a general one of fixed gain and affine bias, is PD control in torque. A velocity actuator
    is a velocity loop. A dcmotor with a position or velocity input has the law that MuJoCo computes for it. Motors have
    no law, nor has a dcmotor with states of its own: an integral part, an inductance, or heat.

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
        laws = [law for a, gear in actuators_of(model, joint) if (law := _law(library, model, joint, a, gear))]
        if len(laws) > 1:
            raise InputError(f"{len(laws)} actuators with a control law", file=path, joint=names.joints[joint])
        if laws:
            found[names.joints[joint]] = laws[0]
    return found


def _law(library: Any, model: Any, joint: int, actuator: int, gear: float) -> MjcfLaw | None:
    direct_current = getattr(library.mjtGain, "mjGAIN_DCMOTOR", None)
    if direct_current is not None and model.actuator_gaintype[actuator] == int(direct_current):
        return _dc_law(library, model, joint, actuator, gear)
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


def _dc_law(library: Any, model: Any, joint: int, actuator: int, gear: float) -> MjcfLaw | None:
    """Asks MuJoCo what torque a dcmotor makes at its joint, for small and for large commands."""
    if model.actuator_actnum[actuator] or not gear:
        return None
    data = library.MjData(model)
    at, velocity, control = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint]), control_of(model, actuator)

    def torque(command: float, q: float, dq: float) -> float:
        library.mj_resetData(model, data)
        data.ctrl[:], data.qvel[:] = 0.0, 0.0
        data.qpos[at], data.qvel[velocity], data.ctrl[control] = q, dq, command
        library.mj_forward(model, data)
        return float(data.qfrc_actuator[velocity])

    # A command counts at the motor.
    rest = torque(0.0, 0.0, 0.0)
    by_command, by_q, by_dq = ((torque(*(NEAR * unit)) - rest) / NEAR for unit in np.diag([gear, 1.0, 1.0]))
    limit, late = torque(FAR, 0.0, 0.0), getattr(model, "actuator_delay", None)
    limits = {"torque_limit": abs(limit)} if abs(limit) < HUGE else {}
    if late is not None and float(late[actuator]) > 0:
        limits["delay"] = float(late[actuator])
    if by_command > 0 and np.isclose(by_command, -by_q, rtol=1e-4):
        return MjcfLaw("pd", {"kp": by_command, "kd": max(-by_dq, 0.0), **limits})
    if by_command > 0 and abs(by_q) < 1e-6 * by_command and np.isclose(by_command, -by_dq, rtol=1e-4):
        return MjcfLaw("velocity", {"kv": by_command, **limits})
    return None
