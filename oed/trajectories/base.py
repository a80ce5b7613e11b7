"""The interface of trajectories: kinematics at given times, and a sampled motion."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.signals import Motion

WHOLE_PERIOD_TOLERANCE = 1e-6
"""How far a duration may lie from a multiple of the controller's period, as a fraction of that period."""


class Kinematics(NamedTuple):
    """Position and its first three time derivatives, each of the same shape, in rad, rad/s, rad/s^2 and rad/s^3."""

    q: Array
    dq: Array
    ddq: Array
    dddq: Array


class Trajectory(ABC):
    """A joint motion given in closed form."""

    @property
    @abstractmethod
    def n(self) -> int:
        """Number of joints."""

    @property
    @abstractmethod
    def duration(self) -> float:
        """Duration in s."""

    @abstractmethod
    def sample(self, t: ArrayLike) -> Kinematics:
        """Evaluates the trajectory.

        Args:
            t: times since its start, (N,) [s].

        Returns:
            Position, velocity, acceleration and jerk, each (N, n).
        """

    def motion(self, period: float) -> Motion:
        """Samples the whole trajectory at the controller's period, both ends included.

        Args:
            period: sample period [s].

        Returns:
            The motion at t = 0, period, ..., duration.

        Raises:
            InputError: the duration is no multiple of the period.
        """
        t = period * np.arange(count_periods(self.duration, period) + 1, dtype=np.float64)
        q, dq, ddq, _ = self.sample(t)
        return Motion(t=t, q=q, dq=dq, ddq=ddq)


def count_periods(duration: float, period: float) -> int:
    """Counts the controller periods in a duration.

    Args:
        duration: a time [s].
        period: the controller's period [s].

    Returns:
        duration / period, a whole number.

    Raises:
        InputError: the period is not positive, or the duration is no multiple of it.
    """
    if not (np.isfinite(period) and period > 0):
        raise InputError(f"found the sample period {period} s", allowed="a positive number")
    count = round(duration / period)
    if abs(duration / period - count) > WHOLE_PERIOD_TOLERANCE * max(1, count * 1e-3):
        longer = np.ceil(duration / period) * period
        raise InputError(
            f"the duration {duration:.9g} s is not a multiple of the sample period {period:.9g} s",
            remedy=f"use {longer:.9g} s (a base frequency of {1 / longer:.9g} Hz), or another period",
        )
    return count


def round_up(duration: float, period: float) -> float:
    """Rounds a duration up to the next multiple of the controller's period.

    Args:
        duration: a time [s].
        period: the controller's period [s].

    Returns:
        The smallest multiple of the period that is no shorter [s]; a multiple met to 1e-9 periods counts as met.
    """
    return float(np.ceil(duration / period - 1e-9) * period)


def frozen(values: ArrayLike, name: str, ndim: int) -> Array:
    """Copies an array argument into a read-only float64 array.

    Args:
        values: what the caller gave.
        name: its name, for the error message.
        ndim: the number of dimensions it must have.

    Returns:
        The copy.

    Raises:
        InputError: the array has another number of dimensions, or holds a number that is not finite.
    """
    array = np.array(values, dtype=np.float64)
    if array.ndim != ndim:
        raise InputError(f"{name} has {array.ndim} dimensions", allowed=f"{ndim}")
    if not np.all(np.isfinite(array)):
        raise InputError(f"{name} contains a value that is not finite", allowed="finite numbers")
    array.setflags(write=False)
    return array
