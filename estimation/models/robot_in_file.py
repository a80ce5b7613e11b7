"""The robot within a model file: all of its description that a model's torque refers to."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.plain import all_finite, number
from robots.geometry.chain import Chain, Joint
from robots.joints.velocity_ramps import NO_RAMP, VelocityRamp
from robots.limits import BOUNDS, Limits
from robots.robot import Robot
from robots.terms.situations.flange_body import FLANGE

_BY_JOINT = ("rotor_inertia", "gear_ratio", "torque_constant")


def describe_robot(robot: Robot) -> dict[str, Any]:
    """Writes a robot as plain data.

    Terms need only its chain. Effects need more: a spring the middle of a joint's range, saturation the torque limit,
    load-dependent effects the rotor inertia that the base model does not separate from the link.
    """
    joints = [
        {
            "name": joint.name,
            "kind": joint.kind,
            "rotation": joint.rotation.tolist(),
            "translation": joint.translation.tolist(),
            "axis": joint.axis.tolist(),
        }
        for joint in robot.chain.joints
    ]
    return {
        "name": robot.name,
        "origin": robot.origin,
        "sha256": robot.digest,
        "gravity": robot.chain.gravity.tolist(),
        "joints": joints,
        "tip": robot.chain.tip.tolist(),
        **{name: all_finite(getattr(robot, name)) for name in _BY_JOINT},
        "limits": {name: all_finite(getattr(robot.limits, name)) for name in BOUNDS} | _ramp_of(robot.limits),
    }


def _ramp_of(limits: Limits) -> dict[str, Any]:
    if limits.ramp is None:
        return {}
    return {"ramp": {name: getattr(limits.ramp, name).tolist() for name in NO_RAMP} | {"share": limits.ramp.share}}


def build_robot(data: Mapping[str, Any]) -> Robot:
    """Reads what `describe_robot` wrote; what older files do not state is unknown.

    Raises:
        InputError: values that are impossible for a robot.
    """
    joints = tuple(Joint(**joint) for joint in data["joints"])
    n, limits = len(joints), data.get("limits", {})
    bounds: dict[str, Any] = {name: _array(limits.get(name), n, np.inf) for name in BOUNDS if name != "lower"}
    return Robot(
        name=data["name"],
        chain=Chain(joints, np.array(data["gravity"]), np.array(data.get("tip", np.eye(4)))),
        limits=Limits(
            lower=_array(limits.get("lower"), n, -np.inf),
            ramp=VelocityRamp(**limits["ramp"]) if "ramp" in limits else None,
            **bounds,
        ),
        rotor_inertia=_array(data.get("rotor_inertia"), n, 0.0),
        gear_ratio=_array(data.get("gear_ratio"), n, 1.0),
        torque_constant=_array(data.get("torque_constant"), n, np.nan),
        origin=data["origin"],
        digest=data["sha256"],
        assumed=() if "tip" in data else (FLANGE,),
    )


def require_described(data: Mapping[str, Any]) -> None:
    """Refuses the robot of a file that does not state what effects refer to.

    Raises:
        InputError: a file of an older version.
    """
    if "limits" not in data:
        raise InputError(
            "the model has effects but lacks the robot's limits, which some of them need",
            remedy="it was written by another version: diagnose the logs again",
        )


def _array(values: Any, n: int, unknown: float) -> Array:
    """Null stands for numbers that JSON cannot hold; missing entries are unknown."""
    given = [None] * n if values is None else values
    return np.array([number(value, unknown) for value in given])
