"""Which rows of a log hold no information: one table with one rule each, and the log without those that no fit uses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from estimation.preprocessing import rows_at_rest
from estimation.recordings.rows.columns import Columns, ImpossibleValue, impossible_values, joint_torques
from estimation.recordings.rows.motion import standing_joints
from estimation.recordings.rows.one_log import Recorded
from estimation.recordings.rows.timing import FEWEST, Timing, measure_timing
from robots.common.arrays import Array, Flags
from robots.signals import Log


@dataclass(frozen=True)
class RowFlag:
    """One reason for which a row holds no information.

    Attributes:
        meaning: what such a row holds.
        rule: gives the flags of all rows (N,), or of all rows and joints (N, n).
        left_out: whether no fit uses the row; otherwise it depends on what is asked.
    """

    meaning: str
    rule: Callable[[Recorded], Flags]
    left_out: bool = False


def _at(recorded: Recorded, rows: NDArray[np.intp]) -> Flags:
    return np.isin(np.arange(len(recorded.log)), rows)


FLAGS = {
    "outlier": RowFlag("a value that leaves its neighbours and returns", lambda r: _at(r, r.spikes), left_out=True),
    "copy": RowFlag("the row before, with a new time", lambda r: _at(r, r.repeated.copies), left_out=True),
    "untimed": RowFlag("a row that was written late by an unknown time", lambda r: _at(r, r.times.lost), left_out=True),
    "at rest": RowFlag(
        "a joint that stands: friction or a brake holds it with any torque", lambda r: rows_at_rest(r.log.t, r.log.q)
    ),
}


def flagged(recorded: Recorded, *names: str) -> Flags:
    """Finds the rows, joint by joint (N, n), that have one of some flags.

    Args:
        recorded: the log.
        names: of `FLAGS`.
    """
    found = np.zeros((len(recorded.log), recorded.robot.n), dtype=bool)
    for name in names:
        flags = FLAGS[name].rule(recorded)
        found |= flags if flags.ndim == 2 else flags[:, None]
    return found


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
        log = self._recorded.log
        left_out = flagged(self._recorded, *(name for name, flag in FLAGS.items() if flag.left_out)).any(axis=1)
        return log.rows(np.flatnonzero(~left_out)) if left_out.any() else log

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
