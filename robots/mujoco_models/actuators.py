"""What a MuJoCo model's actuators add to a joint: torque limits, and since version 4 inertia and damping."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

FIXED_GAIN = 0  # mjtGain


def actuators_of(model: Any, joint: int) -> Iterator[tuple[int, float]]:
    """Lists a joint's actuators with their gears.

    Args:
        model: the compiled model.
        joint: its number in the model.

    Yields:
        The number of the actuator and its gear ratio.
    """
    for a in range(len(model.actuator_trntype)):
        # mjTRN_JOINT, mjTRN_JOINTINPARENT
        if model.actuator_trntype[a] in (0, 1) and model.actuator_trnid[a, 0] == joint:
            yield a, float(model.actuator_gear[a, 0])


def effort_limit(model: Any, joint: int) -> float:
    """Gives the largest torque or force [N m or N] that a joint's actuators can make in both directions.

    Args:
        model: the compiled model.
        joint: its number in the model.

    Returns:
        The limit; infinite if nothing limits it.
    """
    highs = [_largest(model, a) * abs(gear) for a, gear in actuators_of(model, joint)]
    limit = float(np.sum(highs)) if highs else np.inf
    if model.jnt_actfrclimited[joint]:
        limit = min(limit, float(np.min(np.abs(model.jnt_actfrcrange[joint]))))
    # A limit of zero is one that nobody stated.
    return limit if limit > 0.0 else np.inf


def _largest(model: Any, actuator: int) -> float:
    bounds = [np.inf]
    if model.actuator_forcelimited[actuator]:
        bounds.append(float(np.min(np.abs(model.actuator_forcerange[actuator]))))
    unbiased = model.actuator_biastype[actuator] == 0  # mjBIAS_NONE
    direct = model.actuator_gaintype[actuator] == FIXED_GAIN and unbiased
    control = control_of(model, actuator)
    if direct and model.actuator_ctrllimited[control]:
        reach = float(np.min(np.abs(model.actuator_ctrlrange[control])))
        bounds.append(reach * abs(float(model.actuator_gainprm[actuator, 0])))
    return min(bounds)


def control_of(model: Any, actuator: int) -> int:
    """The number of an actuator's control input; since version 4 they are counted separately."""
    addresses = getattr(model, "actuator_ctrladr", None)
    return actuator if addresses is None else int(addresses[actuator])


def added_by_actuators(model: Any, joint: int) -> tuple[float, float]:
    """Gives inertia and damping that actuators add to a joint, both times the square of their gear ratio.

    Args:
        model: the compiled model.
        joint: its number in the model.

    Returns:
        The inertia [kg m2 or kg] and the damping [N m s/rad or N s/m]; MuJoCo before version 4 has none.
    """
    inertia = damping = 0.0
    if hasattr(model, "actuator_armature") and hasattr(model, "actuator_damping"):
        for a, gear in actuators_of(model, joint):
            inertia += gear**2 * float(model.actuator_armature[a])
            damping += gear**2 * float(model.actuator_damping[a])
    return inertia, damping
