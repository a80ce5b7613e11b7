"""A log without the rows that a fit leaves out."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from estimation.gate.measurements.columns import Columns
from estimation.gate.measurements.impossible_values import ImpossibleValue, impossible_values
from estimation.gate.measurements.joint_torques import joint_torques
from estimation.gate.measurements.motion import standing_joints
from estimation.gate.measurements.timing import FEWEST, Timing, measure_timing
from estimation.gate.stages.recorded import Recorded
from robots.signals import Log

Array = NDArray[np.float64]


class Cleaned:
    """The log without outliers, copies and rows without a known time.

    Attributes:
        robot: with n joints.
    """

    def __init__(self, recorded: Recorded) -> None:
        self.robot, self._recorded = recorded.robot, recorded

    @cached_property
    def log(self) -> Log:
        """Its rows."""
        log, left_out = self._recorded.log, np.union1d(self._recorded.spikes, self._recorded.stale)
        return log.rows(np.delete(np.arange(len(log)), left_out)) if len(left_out) else log

    @cached_property
    def timing(self) -> Timing:
        """Its time steps and gaps."""
        recorded = self._recorded
        if self.log is recorded.log:
            return recorded.timing
        return measure_timing(self.log.t, recorded.log.t[recorded.clock_steps.rows])

    @cached_property
    def columns(self) -> Columns:
        """Its columns."""
        return self._recorded.columns if self.log is self._recorded.log else Columns.of(self.log)

    @cached_property
    def impossible(self) -> tuple[ImpossibleValue, ...]:
        """Values that no joint can have."""
        return impossible_values(self.columns)

    @property
    def can_be_smoothed(self) -> bool:
        """Whether there are enough rows, all with possible values: squares of others overflow."""
        return len(self.log) >= FEWEST and not self.impossible

    @property
    def torque(self) -> Array | None:
        """Torques (N, n) [N m or N]; currents [A] without a known torque constant; None without either."""
        return self._torque_and_factor[0]

    @cached_property
    def spread(self) -> Array:
        """Standard deviation of the torques (n,), zero for constant ones and for joints that stand: nothing to fit."""
        moves = self.columns.varies & ~standing_joints(self.robot, self.columns)
        return np.asarray(np.where(moves, self.columns.spread, 0.0) * self._torque_and_factor[1])

    @cached_property
    def _torque_and_factor(self) -> tuple[Array | None, Array]:
        return joint_torques(self.robot, self.log)
