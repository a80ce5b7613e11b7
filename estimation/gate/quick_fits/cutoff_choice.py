"""The cut-off of the smoothing that predicts held-out torque best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from estimation.gate.quick_fits.excerpts import Excerpt, cutoffs, excerpts_of, stretch, stretches
from estimation.gate.quick_fits.joint_fit import Rows
from estimation.gate.quick_fits.whole_fit import fit_all
from estimation.recordings.rows.row_flags import Cleaned
from robots.common.arrays import Array
from robots.robot import Robot
from robots.signals import Log

# Rows from which the cut-off is chosen, and the fewest that are fitted.
CHOICE_ROWS, FEWEST_ROWS = 1500, 60
# The highest cut-off is used whose error (mean log) is worse than the smallest by at most this: a high cut-off shows
# inertias better. For delays, which a low cut-off hides, a larger error is accepted.
SLACK, SHARP_SLACK = 0.03, 0.3


@dataclass(frozen=True, eq=False)
class SmoothedLog:
    """Excerpts of a log, smoothed.

    Attributes:
        robot: with n joints.
        excerpts: at the chosen cut-off.
        cost: mean log of the held-out torque error over its standard deviation, on some `CHOICE_ROWS` rows; 0 without
            torque.
        can_be_fitted: whether there are torques, and enough rows.
        sharp_excerpts: at the cut-off for delays.
        sharp_cutoff: that cut-off [Hz].
    """

    robot: Robot
    excerpts: tuple[Excerpt, ...]
    cost: float = 0.0
    can_be_fitted: bool = False
    sharp_excerpts: tuple[Excerpt, ...] = ()
    sharp_cutoff: float = 0.0

    @cached_property
    def rows(self) -> Rows | None:
        """All excerpts with the columns of the regressor; None if they cannot be fitted."""
        return Rows.of(self.robot, self.excerpts) if self.can_be_fitted else None

    @cached_property
    def sharp(self) -> Rows | None:
        """The same at the cut-off for delays."""
        same = self.sharp_excerpts is self.excerpts
        return self.rows if same or not self.can_be_fitted else Rows.of(self.robot, self.sharp_excerpts)


def smooth_log(
    robot: Robot, log: Log, torque: Array | None, parts: Sequence[tuple[int, int]], period: float, spread: Array
) -> SmoothedLog:
    """Smooths excerpts of a log at the cut-off that predicts held-out torque best.

    Args:
        robot: with n joints.
        log: of n joints.
        torque: (N, n), or None.
        parts: (first, stop) rows between gaps.
        period: median sample period [s].
        spread: standard deviations of the torques (n,), zero for a joint that is not fitted.
    """
    found = (stretch(log, torque, piece, period) for piece in stretches(parts))
    pieces = [part for part in found if part is not None]
    candidates = cutoffs(period)
    if torque is None:
        return SmoothedLog(robot, excerpts_of(pieces, period, candidates[len(candidates) // 2]))
    joints = np.flatnonzero(spread > 0)
    tried: list[tuple[float, tuple[Excerpt, ...], float]] = []
    for cutoff in candidates if len(joints) else ():
        excerpts = excerpts_of(pieces, period, cutoff)
        if sum(len(part.t) for part in excerpts) < FEWEST_ROWS:
            continue
        moments = Rows.of(robot, excerpts, CHOICE_ROWS).moments(joints, raw=True)
        error = np.clip(fit_all(moments, spread).unexplained[joints], 1e-9, 1.0)
        tried.append((float(np.mean(np.log(error))), excerpts, cutoff))
    if not tried:
        return SmoothedLog(robot, excerpts_of(pieces, period, candidates[-1]))
    lowest = min(cost for cost, _, _ in tried)
    cost, excerpts, _ = [candidate for candidate in tried if candidate[0] <= lowest + SLACK][-1]
    _, sharp, sharp_cutoff = [candidate for candidate in tried if candidate[0] <= lowest + SHARP_SLACK][-1]
    return SmoothedLog(robot, excerpts, cost, True, sharp, sharp_cutoff)


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
