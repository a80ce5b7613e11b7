"""Checks of each stage: kinematic limits, torque by the nominal dynamics, and rest in the home pose."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from oed.campaigns.stages import Stage
from oed.trajectories.sequence import ACCELERATION_TOLERANCE, POSITION_TOLERANCE, VELOCITY_TOLERANCE
from robots.common.arrays import Array
from robots.common.errors import InfeasibleError, InputError
from robots.limits import Margin, symmetric_margins
from robots.regressor import TorqueModel, default_model
from robots.robot import Robot
from robots.signals import Motion


class TorqueCheck:
    """Joint torques by a robot's own description.

    Args:
        robot: the robot.
        margin: share of the torque limits kept for what the description is wrong by, 0 to below 1.

    Raises:
        InputError: a margin out of range.
    """

    def __init__(self, robot: Robot, margin: float) -> None:
        if not 0.0 <= margin < 1.0:
            raise InputError(f"a torque margin of {margin}", allowed="0 to below 1")
        self.margin, self._limit = margin, np.asarray(robot.limits.torque)
        # Speed below which Coulomb friction fades [rad/s], as in the virtual robot.
        model = default_model(robot, velocity_scale=1e-3)
        known = bool(model.described and np.isfinite(self._limit).any())
        self._model: TorqueModel | None = model if known else None

    @property
    def known(self) -> bool:
        """Whether the description states dynamics and a torque limit."""
        return self._model is not None

    def margins(self, motion: Motion) -> list[Margin]:
        """Gives the closest approach of each joint to its torque limit; nothing where it is not known."""
        if self._model is None:
            return []
        tau = self._model.torque(motion.q, motion.dq, motion.ddq, self._model.nominal)
        return symmetric_margins("torque", motion.t, tau, self._limit)

    def worst(self, motion: Motion) -> Margin | None:
        """Gives the joint that comes closest to its torque limit."""
        return min(self.margins(motion), key=lambda margin: margin.slack_fraction, default=None)

    def keeps(self, motion: Motion) -> bool:
        """Whether all torques leave the margin free."""
        worst = self.worst(motion)
        return worst is None or worst.slack_fraction >= self.margin


def checked(stage: Stage, robot: Robot, home: Array, torque: TorqueCheck) -> Stage:
    """Measures a stage against all limits.

    Args:
        stage: the stage.
        robot: whose limits count.
        home: pose (n,) at both ends [rad or m].
        torque: the torque limits.

    Returns:
        The stage with its margins.

    Raises:
        InputError: a motion of another number of joints.
        InfeasibleError: a limit is passed, or it does not begin and end at rest at home.
    """
    margins = (*robot.limits.margins(stage.motion), *torque.margins(stage.motion))
    result = replace(stage, margins=margins)
    require_rest(stage, home)
    for margin in result.violated:
        raise InfeasibleError(
            f"the {stage.name} stage exceeds the {margin.quantity} limit: {margin.value:.4g} at {margin.time:.3f} s",
            joint=margin.joint,
            allowed=f"{margin.limit:.6g}",
            remedy="design the excitation within the robot's limits, or reduce --velocity-fraction",
        )
    return result


def require_rest(stage: Stage, home: Array) -> None:
    """Checks that a stage begins and ends at rest at home, so that stages can be played in any order.

    Raises:
        InfeasibleError: naming the joint and the end.
    """
    motion = stage.motion
    wanted = (
        ("position", motion.q - home, POSITION_TOLERANCE),
        ("velocity", motion.dq, VELOCITY_TOLERANCE),
        ("acceleration", motion.ddq, ACCELERATION_TOLERANCE),
    )
    for row, end in ((0, "begins"), (-1, "ends")):
        for quantity, values, tolerance in wanted:
            off = np.abs(values[row])
            if off.max() > tolerance:
                raise InfeasibleError(
                    (
                        f"the {stage.name} stage {end} with a {quantity} that differs by {off.max():.3g} from rest in "
                        f"the home pose"
                    ),
                    joint=int(off.argmax()) + 1,
                    allowed=f"{tolerance:g}",
                )
