"""A log made ready for regression: torque, positions on a grid, and which rows count."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.preprocessing import Resampled, resample, smooth
from estimation.preprocessing.smoothing import transient
from robots.common.errors import InputError
from robots.robot import Robot
from robots.signals import Log, Motion

Array = NDArray[np.float64]

# Below this share of a joint's RMS speed its friction is not known to have a sign: those rows are left out of its fit.
SLOW = 0.008
# A joint with less RMS speed than this [rad/s or m/s] stands: what is left is rounding, not to be taken for motion.
STANDING = 1e-9


@dataclass(frozen=True)
class Rows:
    """What a fit sees of a log.

    Attributes:
        motion: smoothed, at the log's own times.
        tau: measured torque (N, n), as it was logged.
        mask: (N, n), zero where a row of a joint does not count.
    """

    motion: Motion
    tau: Array
    mask: Array


@dataclass(frozen=True)
class Prepared:
    """A log with torque, and its positions on a uniform grid.

    Attributes:
        log: as it was recorded.
        tau: joint torque (N, n) [N m or N].
        positions: on the grid.
    """

    log: Log
    tau: Array
    positions: Resampled

    def rows(self, cutoff: float, stride: int = 1) -> Rows:
        """Smooths the log and leaves out its ends, where the smoothing has nothing to lean on.

        Args:
            cutoff: of the smoothing [Hz].
            stride: take every so many rows.
        """
        motion = smooth(self.positions, cutoff)
        t = motion.t
        edge = transient(motion.duration, cutoff)
        inside = np.flatnonzero((t >= t[0] + edge) & (t <= t[-1] - edge))[::stride]
        dq = motion.dq[inside]
        speed = np.sqrt(np.mean(dq**2, axis=0))
        moves = speed >= STANDING
        fast = (np.abs(dq) >= SLOW * speed) | ~moves
        cut = Motion(t=t[inside], q=motion.q[inside], dq=dq * moves, ddq=motion.ddq[inside] * moves)
        return Rows(cut, self.tau[inside], fast.astype(float))


def prepare(robot: Robot, log: Log) -> Prepared:
    """Finds the torque of a log and puts its positions on a grid.

    Raises:
        InputError: another number of joints, currents without torque constants, or too few rows.
    """
    file = log.metadata.get("file", log.name or None)
    if log.n != robot.n:
        raise InputError(f"{log.n} joints", file=file, allowed=f"{robot.n}, as {robot.name} has")
    try:
        return Prepared(log, torque_of(robot, log), resample(log.t, log.q))
    except InputError as error:
        raise InputError(
            error.problem, file=file, joint=error.joint, allowed=error.allowed, remedy=error.remedy
        ) from error


def torque_of(robot: Robot, log: Log) -> Array:
    """Gives the measured torque (N, n), from currents by the robot's torque constants where there is none.

    Raises:
        InputError: neither torque nor current, or a current whose torque constant is not known.
    """
    if log.tau is not None:
        return log.tau
    if log.current is None:
        raise InputError("neither torque nor current", allowed="tau1.. [N m] or i1.. [A]")
    constant = np.asarray(robot.torque_constant)
    if not np.isfinite(constant).all():
        raise InputError(
            "has currents, but the robot's description has no torque constant",
            joint=int(np.argmin(np.isfinite(constant))) + 1,
            remedy="state torque_constant under drives in the robot YAML",
        )
    return log.current * constant
