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
    known = expressible(result)
    late = round(float(np.max(known.delay)) / STEP)
    entries = {
        "stiffness": known.kp,
        "damping": known.kd,
        "armature": known.armature,
        "friction": known.friction,
        "dynamic_friction": known.friction,
        "viscous_friction": known.damping,
    }
    lines = [
        f'"""Drives of {result.robot}, identified by robot-oed {VERSION}."""',
        "",
        *(f"# Not expressed: {text}" for text in _left_out(known)),
        "from isaaclab.actuators import DelayedPDActuatorCfg",
        "",
        "DRIVES = DelayedPDActuatorCfg(",
        f"    joint_names_expr={[f'^{re.escape(name)}$' for name in result.joints]!r},",
    ]
    for key, values in entries.items():
        lines.append(f"    {key}={_by_name(result, values)},")
    if np.isfinite(known.limit).all():
        lines.append(f"    effort_limit={_by_name(result, known.limit)},")
    lines += [
        f"    # {1e3 * float(np.max(known.delay)):.3g} ms in physics steps of {1e3 * STEP:g} ms: scale it to yours.",
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
    known = expressible(result)
    joints = [
        {
            "joint": name,
            "delay": {"seconds": float(known.delay[j])},
            "drive": {
                "type": "pd",
                "kp": float(known.kp[j]),
                "kd": float(known.kd[j]),
                "const_effort": -float(known.offset[j]),
            },
            "clamping": [{"type": "max_effort", "max_effort": float(known.limit[j])}]
            if np.isfinite(known.limit[j])
            else [],
            "joint_properties": {
                "armature": float(known.armature[j]),
                "friction": float(known.friction[j]),
                "damping": float(known.damping[j]),
            },
        }
        for j, name in enumerate(result.joints)
    ]
    data = {
        "made_by": f"robot-oed {VERSION}",
        "robot": result.robot,
        "units": "SI",
        "joints": joints,
        "not_expressed": _left_out(known),
    }
    return json.dumps(data, indent=2) + "\n"


def _left_out(known: Expressible) -> list[str]:
    masses = [f"link mass times {factor:.3g}" for factor in known.mass_factor if factor != 1.0]
    return [*known.left_out, *masses]


def _by_name(result: Actuators, values: np.ndarray) -> str:
    pairs = ", ".join(f"{name!r}: {float(value):.6g}" for name, value in zip(result.joints, values, strict=True))
    return "{" + pairs + "}"
