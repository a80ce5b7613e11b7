"""A log as it was recorded."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from estimation.recordings.rows.columns import Columns
from estimation.recordings.rows.held_values import (
    Hang,
    RepeatedRows,
    between_updates,
    cut_hangs,
    find_hangs,
    find_repeated_rows,
    find_updates,
)
from estimation.recordings.rows.late_rows import CorrectedTimes, correct_times
from estimation.recordings.rows.motion import moving_rows, standing_joints
from estimation.recordings.rows.outliers import find_outliers, isolated_rows
from estimation.recordings.rows.timing import ClockSteps, Timing, find_clock_steps, measure_timing
from estimation.recordings.rows.wraps import Wraps, find_wraps
from robots.robot import Robot
from robots.signals import Log

Rows = NDArray[np.intp]


class Recorded:
    """All rows of the log. Only times of rows that were written late, and wrapped angles, are corrected.

    Attributes:
        robot: with n joints, as it was set up for the log.
        original: the log with its own times.
    """

    def __init__(self, robot: Robot, log: Log) -> None:
        self.robot, self.original = robot, log

    @cached_property
    def times(self) -> CorrectedTimes:
        """Corrected times, and rows without a known time."""
        return correct_times(self.unwrapped)

    @cached_property
    def wraps(self) -> tuple[Wraps, ...]:
        """The revolute joints whose angles wrap."""
        found = (
            find_wraps(joint, self.original.q[:, joint], self.original.t)
            for joint, kind in enumerate(self.robot.chain.kinds)
            if kind == "revolute"
        )
        return tuple(wraps for wraps in found if wraps is not None)

    @cached_property
    def unwrapped(self) -> Log:
        """The log with its own times and unwrapped angles."""
        if not self.wraps:
            return self.original
        q = np.array(self.original.q)
        for wraps in self.wraps:
            q[:, wraps.joint] = wraps.q
        return replace(self.original, q=q)

    @cached_property
    def log(self) -> Log:
        """The log with corrected times, unwrapped angles, and torques between their updates."""
        log = self.unwrapped
        log = log if self.times.t is self.original.t else replace(log, t=self.times.t)
        return between_updates(log, self.updates)

    @cached_property
    def updates(self) -> Rows:
        """Rows in which the torques are updated, where others repeat them."""
        columns = Columns.of(self.unwrapped)
        copied = len(find_repeated_rows(self.unwrapped, columns, moving_rows(self.unwrapped, columns)).copies)
        return np.zeros(0, dtype=np.intp) if copied else find_updates(columns)

    @cached_property
    def timing(self) -> Timing:
        """Its time steps and gaps."""
        return measure_timing(self.log.t, self.log.t[self.clock_steps.rows])

    @cached_property
    def clock_steps(self) -> ClockSteps:
        """Steps of the clock."""
        return find_clock_steps(self.log.t, self.columns)

    @cached_property
    def columns(self) -> Columns:
        """Its columns."""
        return Columns.of(self.log)

    @cached_property
    def moving(self) -> NDArray[np.bool_]:
        """Rows (N,) in which the arm moves."""
        return moving_rows(self.log, self.columns)

    @cached_property
    def standing(self) -> NDArray[np.bool_]:
        """Joints (n,) that stand still."""
        return standing_joints(self.robot, self.columns)

    @cached_property
    def repeated(self) -> RepeatedRows:
        """Rows that repeat the row before."""
        return find_repeated_rows(self.log, self.columns, self.moving)

    @cached_property
    def hangs(self) -> tuple[Hang, ...]:
        """Columns that hung."""
        return find_hangs(self.columns, self.moving)

    @cached_property
    def outliers(self) -> dict[tuple[str, int], Rows]:
        """Rows with outliers, by the column's prefix and joint, counted from 0."""
        return find_outliers(self.columns)

    @cached_property
    def spikes(self) -> Rows:
        """Rows with isolated outliers, which a fit leaves out."""
        return isolated_rows(self.columns, self.outliers)

    @cached_property
    def stale(self) -> Rows:
        """Rows with wrong times, which a fit leaves out."""
        return np.union1d(self.repeated.copies, self.times.lost)

    @property
    def parts(self) -> tuple[tuple[int, int], ...]:
        """Parts (first, stop) without a gap and without a column that hung."""
        return cut_hangs(self.timing.parts, self.hangs)

    @property
    def motion_parts(self) -> tuple[tuple[int, int], ...]:
        """Parts (first, stop) without a gap and without a position that hung."""
        return cut_hangs(self.timing.parts, [hang for hang in self.hangs if hang.prefix == "q"])
