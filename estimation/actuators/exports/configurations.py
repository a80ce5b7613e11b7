"""Identified drives as configurations of Isaac Lab and Newton."""

from __future__ import annotations

import json
import re

import numpy as np

from estimation.actuators.exports.expressible import Expressible, expressible
from estimation.actuators.result import Actuators
from robots.version import VERSION

STEP = 0.005
"""Physics step [s] by which Isaac Lab's delays are counted in the written file; its reader may change it."""


def isaac_lab_text(result: Actuators) -> str:
    """Writes a Python module with a `DelayedPDActuatorCfg` of all joints (Isaac Lab 2.2 and later).

    Args:
        result: identified drives.
    """
    told = expressible(result)
    late = round(float(np.max(told.delay)) / STEP)
    entries = {
        "stiffness": told.kp,
        "damping": told.kd,
        "armature": told.armature,
        "friction": told.friction,
        "dynamic_friction": told.friction,
        "viscous_friction": told.damping,
    }
    lines = [
        f'"""Drives of {result.robot}, identified by robot-oed {VERSION}."""',
        "",
        *(f"# Not expressed: {text}" for text in _left_out(told)),
        "from isaaclab.actuators import DelayedPDActuatorCfg",
        "",
        "DRIVES = DelayedPDActuatorCfg(",
        f"    joint_names_expr={[f'^{re.escape(name)}$' for name in result.joints]!r},",
    ]
    for key, values in entries.items():
        lines.append(f"    {key}={_by_name(result, values)},")
    if np.isfinite(told.limit).all():
        lines.append(f"    effort_limit={_by_name(result, told.limit)},")
    lines += [
        f"    # {1e3 * float(np.max(told.delay)):.3g} ms in physics steps of {1e3 * STEP:g} ms: scale it to yours.",
        f"    min_delay={late},",
        f"    max_delay={late},",
        ")",
        "",
    ]
    return "\n".join(lines)


def newton_text(result: Actuators) -> str:
    """Writes JSON with delay, drive and clamp of each joint, as Newton composes its actuators.

    Args:
        result: identified drives.
    """
    told = expressible(result)
    joints = [
        {
            "joint": name,
            "delay": {"seconds": float(told.delay[j])},
            "drive": {
                "type": "pd",
                "kp": float(told.kp[j]),
                "kd": float(told.kd[j]),
                "const_effort": -float(told.offset[j]),
            },
            "clamping": [{"type": "max_effort", "max_effort": float(told.limit[j])}]
            if np.isfinite(told.limit[j])
            else [],
            "joint_properties": {
                "armature": float(told.armature[j]),
                "friction": float(told.friction[j]),
                "damping": float(told.damping[j]),
            },
        }
        for j, name in enumerate(result.joints)
    ]
    data = {
        "made_by": f"robot-oed {VERSION}",
        "robot": result.robot,
        "units": "SI",
        "joints": joints,
        "not_expressed": _left_out(told),
    }
    return json.dumps(data, indent=2) + "\n"


def _left_out(told: Expressible) -> list[str]:
    masses = [f"link mass times {factor:.3g}" for factor in told.mass_factor if factor != 1.0]
    return [*told.left_out, *masses]


def _by_name(result: Actuators, values: np.ndarray) -> str:
    pairs = ", ".join(f"{name!r}: {float(value):.6g}" for name, value in zip(result.joints, values, strict=True))
    return "{" + pairs + "}"
