"""Torques of a log, also if it has currents."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robots.robot import Robot
from robots.signals import Log

Array = NDArray[np.float64]


def joint_torques(robot: Robot, log: Log) -> tuple[Array | None, Array]:
    """Gives the torques of a log, from its currents if it has no torques.

    Args:
        robot: with n joints; a current without a known torque constant is used as it is.
        log: of n joints.

    Returns:
        Torques (N, n) [N m or N], None if the log has neither, and the factors from the logged signal to them (n,).
    """
    if log.tau is not None or log.current is None:
        return log.tau, np.ones(robot.n)
    constant = np.asarray(robot.torque_constant)
    constant = np.where(np.isfinite(constant), constant, 1.0)
    return log.current * constant, np.abs(constant)
