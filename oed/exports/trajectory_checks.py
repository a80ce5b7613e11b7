"""Whether a robot may play a trajectory: its robot, its joints, its limits, and rest at both ends."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from robots.common.errors import InputError
from robots.limits import Margin, symmetric_margins
from robots.regressor import default_model
from robots.robot import Robot
from robots.signals import Motion

FREE = "No collision"
"""How the text under ``collisions`` begins, in a trajectory that is proved free of them."""

UNKNOWN_COLLISIONS = "NOT CHECKED for collisions, as far as its file says."
"""What is said of a trajectory whose file does not state under ``collisions`` what was checked."""


def stated_collisions(metadata: Mapping[str, Any]) -> tuple[str, bool]:
    """Reads what a trajectory's file states of collisions, and whether it is proved free of them.

    Args:
        metadata: what the file says of itself.
    """
    text = str(metadata.get("collisions") or UNKNOWN_COLLISIONS)
    return text, text.startswith(FREE)


def is_made_for(stated: str, robot: Robot) -> bool:
    """Whether the robot that a file states is this one: by name, or by the name of its file in any folder.

    Args:
        stated: a catalogue name, or the path of a robot's file.
        robot: the robot.
    """
    return stated in (robot.name, robot.origin) or Path(stated).stem in (robot.name, Path(robot.origin).stem)


def check_trajectory(
    motion: Motion, robot: Robot, metadata: Mapping[str, Any] | None = None, file: str | PathLike[str] | None = None
) -> None:
    """Refuses a trajectory that this robot must not play.

    The torque is that of the nominal model, where the robot's description gives one.

    Args:
        motion: the trajectory.
        robot: the robot.
        metadata: what the file says of itself.
        file: for messages.

    Raises:
        InputError: a trajectory of another robot, a limit of position, velocity, acceleration or torque that is
            exceeded, or a motion at an end.
    """
    stated = str((metadata or {}).get("robot") or "")
    if stated and not is_made_for(stated, robot):
        raise InputError(
            f"the trajectory is of the robot {stated}, not of {robot.name}",
            file=file,
            remedy="give its own robot, or design one for this robot",
        )
    if motion.n != robot.n:
        raise InputError(f"the trajectory has {motion.n} joints, {robot.name} has {robot.n}", file=file)
    kinds = (metadata or {}).get("kinds")
    if kinds is not None and tuple(kinds) != robot.chain.kinds:
        joint = next(i for i, (one, other) in enumerate(zip(kinds, robot.chain.kinds, strict=True)) if one != other)
        raise InputError(
            f"the joint is {kinds[joint]} by the units of the file, and {robot.chain.kinds[joint]} in {robot.name}",
            file=file,
            joint=joint + 1,
            remedy="give its own robot",
        )
    _check_limits(motion, robot, file)
    for row, where in ((0, "begins"), (-1, "ends")):
        joint = int(np.abs(motion.dq[row]).argmax())
        # Speed at both ends up to which the robot stands [rad/s or m/s].
        if abs(motion.dq[row, joint]) > 1e-3:
            raise InputError(
                f"the trajectory {where} with a speed of {motion.dq[row, joint]:.3g}",
                file=file,
                joint=joint + 1,
                allowed="rest at both ends",
            )


def _check_limits(motion: Motion, robot: Robot, file: str | PathLike[str] | None) -> None:
    limits = robot.limits
    # A limit may be exceeded by this share: trajectories touch their limits, and files round.
    margins = [(margin, 1e-6) for margin in limits.margins(motion) if margin.quantity != "jerk"]
    # A model's torques are known to 1 %.
    margins += [(margin, 1e-2) for margin in _torque_margins(motion, robot)]
    for margin, share in margins:
        if margin.slack < -share * max(abs(margin.limit), 1.0):
            unit = limits.unit(margin.joint - 1, margin.quantity)
            raise InputError(
                f"{margin.quantity} {margin.value:.4g} {unit} at {margin.time:.4g} s is beyond the limit "
                f"{margin.limit:.4g} {unit}",
                file=file,
                joint=margin.joint,
                remedy=f"design or retime it within the limits of {robot.name}",
            )


def _torque_margins(motion: Motion, robot: Robot) -> list[Margin]:
    if not np.isfinite(robot.limits.torque).any():
        return []
    model = default_model(robot, offset=False)
    if not model.described:
        return []
    tau = model.torque(motion.q, motion.dq, motion.ddq, model.nominal)
    return symmetric_margins("torque", motion.t, tau, robot.limits.torque)
