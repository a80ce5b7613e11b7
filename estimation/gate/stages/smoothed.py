"""Excerpts of a cleaned log, smoothed."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from estimation.gate.quick_fits.cutoff_choice import SmoothedLog, smooth_log
from estimation.gate.quick_fits.excerpts import Excerpt
from estimation.gate.quick_fits.joint_fit import Rows
from estimation.gate.stages.cleaned import Cleaned

Array = NDArray[np.float64]


class Smoothed:
    """Excerpts of the log with velocities and accelerations, at the cut-off that predicts held-out torque best.

    Attributes:
        period: median sample period of the cleaned log [s].
    """

    def __init__(self, cleaned: Cleaned) -> None:
        self.period, self._cleaned = cleaned.timing.period, cleaned

    @cached_property
    def choice(self) -> SmoothedLog:
        """The cut-off and its excerpts."""
        return self._smooth(self._cleaned.log.q)

    @property
    def excerpts(self) -> tuple[Excerpt, ...]:
        """Smoothed stretches of the log; none if all are too short."""
        return self.choice.excerpts

    @property
    def peak_speeds(self) -> Array:
        """Largest speed of each joint in the excerpts (n,) [rad/s or m/s], NaN without excerpts."""
        if not self.excerpts:
            return np.full(self._cleaned.robot.n, np.nan)
        return np.asarray(np.max([np.abs(part.dq).max(axis=0) for part in self.excerpts], axis=0))

    @property
    def rows(self) -> Rows | None:
        """The excerpts with the columns of the regressor; None without torque or with too few rows."""
        return self.choice.rows

    def error_with_positions(self, q: Array) -> float:
        """Gives the mean log of the held-out torque error with other positions (N, n) than the log's."""
        return self._smooth(q).cost

    def _smooth(self, q: Array) -> SmoothedLog:
        cleaned = self._cleaned
        log = cleaned.log if q is cleaned.log.q else replace(cleaned.log, q=q)
        return smooth_log(cleaned.robot, log, cleaned.torque, cleaned.timing.parts, self.period, cleaned.spread)
