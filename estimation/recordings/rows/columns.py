"""A log column by column, with the numbers that several checks need of each."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robots.common.arrays import Array
from robots.robot import Robot
from robots.signals import Log

# A torque varies by rounding only if its range is below this share of its size, or below this value [N m, N or A].
ROUNDING = 1e-9

# Number of values of a column from which its step is estimated.
STEP_SAMPLES = 20_000
# Larger absolute values are impossible in any unit: of a position, and of a torque or current.
MOST_POSITION, MOST_SIGNAL = 1e6, 1e8


@dataclass(frozen=True, eq=False)
class Columns:
    """Positions, and torques or currents, joint by joint.

    Attributes:
        q: positions (n, N).
        signal: torques or currents (n, N); None without.
        prefix: of the signal's columns, ``tau`` or ``i``.
        lowest: positions (n,).
        highest: positions (n,).
        spread: standard deviation of the signal (n,).
        varies: whether the signal varies by more than rounding (n,).
    """

    q: Array
    signal: Array | None
    prefix: str
    lowest: Array
    highest: Array
    spread: Array
    varies: NDArray[np.bool_]

    @staticmethod
    def of(log: Log) -> Columns:
        """Gives the columns of a log."""
        values, prefix = (log.tau, "tau") if log.tau is not None else (log.current, "i")
        # A column is contiguous in memory: sums along the rows of a long log would take ten times as long.
        q = np.ascontiguousarray(log.q.T)
        signal = None if values is None else np.ascontiguousarray(values.T)
        spread, varies = np.zeros(len(q)), np.zeros(len(q), dtype=bool)
        if signal is not None:
            low, high = signal.min(axis=1), signal.max(axis=1)
            spread = signal.std(axis=1)
            varies = high - low > ROUNDING * np.maximum(1.0, np.maximum(np.abs(low), np.abs(high)))
        return Columns(q, signal, prefix, q.min(axis=1), q.max(axis=1), spread, varies)

    @property
    def extremes(self) -> Array:
        """Lowest and highest positions (2, n)."""
        return np.array([self.lowest, self.highest])

    @property
    def travel(self) -> Array:
        """Range of the positions (n,)."""
        return self.highest - self.lowest

    @cached_property
    def position_steps(self) -> Array:
        """Resolution of the positions (n,), 0 for a column without a step."""
        return np.array([lattice_step(column) for column in self.q])

    @cached_property
    def signal_steps(self) -> Array:
        """Resolution of the torques or currents (n,), 0 for a column without a step."""
        return np.zeros(len(self.q)) if self.signal is None else np.array([lattice_step(x) for x in self.signal])

    def extreme(self, joint: int) -> float:
        """Gives the position of a joint, counted from 0, that is farthest from zero."""
        low, high = float(self.lowest[joint]), float(self.highest[joint])
        return low if -low > high else high

    def named(self) -> list[tuple[str, int, Array]]:
        """Lists all columns: prefix, joint counted from 0, values (N,)."""
        signals = () if self.signal is None else self.signal
        return [("q", j, column) for j, column in enumerate(self.q)] + [
            (self.prefix, j, column) for j, column in enumerate(signals)
        ]


def lattice_step(values: Array) -> float:
    """Finds the step of a quantised column, 0 if it has none.

    The smallest distance between neighbouring values is the step if nearly all distances are multiples of it.

    Args:
        values: (N,).
    """
    chosen = values[:: max(1, len(values) // STEP_SAMPLES)]
    distinct = np.unique(chosen)
    if len(distinct) < 3 or len(distinct) > 0.9 * len(chosen):
        # Nearly as many values as samples: a step, if any, is too small to be detected.
        return 0.0
    scale = max(float(np.abs(distinct).max()), 1e-300)
    distances = np.diff(distinct)
    distances = distances[distances > 1e-9 * scale]
    if len(distances) < 2:
        return 0.0
    step = float(np.quantile(distances, 0.01))
    multiples = distances / step
    near = np.abs(multiples - np.round(multiples)) < 0.05
    # The rounding of numbers in the file blurs high multiples: only low ones are used.
    low = multiples < 10.5
    if not low.any() or near[low].mean() < 0.95:
        return 0.0
    steps = low & (multiples > 0.5)
    return float(np.median(distances[steps] / np.round(multiples[steps])))


@dataclass(frozen=True)
class ImpossibleValue:
    """The largest value of a column, if it is impossible.

    Attributes:
        prefix: of the column.
        joint: counted from 0.
        row: counted from 0.
        value: in the unit of the column.
    """

    prefix: str
    joint: int
    row: int
    value: float


def impossible_values(columns: Columns) -> tuple[ImpossibleValue, ...]:
    """Finds the columns with impossible values."""
    found = []
    for prefix, joint, column in columns.named():
        row = int(np.argmax(np.abs(column)))
        if abs(column[row]) > (MOST_POSITION if prefix == "q" else MOST_SIGNAL):
            found.append(ImpossibleValue(prefix, joint, row, float(column[row])))
    return tuple(found)


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
