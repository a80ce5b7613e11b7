"""The limits of position, velocity, acceleration and jerk as linear rows in the free coefficients."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from oed.constraints.between_samples import tightened_bounds
from robots.common.arrays import Array
from robots.common.errors import InfeasibleError, InputError
from robots.limits import Limits

QUANTITIES = ("q", "dq", "ddq", "dddq")


@dataclass(frozen=True, kw_only=True, eq=False)
class KinematicRows:
    """lower_j <= matrix @ x_j <= upper_j for every joint j, with x_j its free coefficients.

    All joints share the block, so the whole Jacobian is block diagonal with n copies of it.

    Args:
        matrix: (R, K) [rad/s^d per unit of coefficient].
        lower: (n, R) [rad/s^d]; -inf where a joint has no limit.
        upper: (n, R) [rad/s^d].
        labels: quantity and sample index of each row, R of them.
    """

    matrix: Array
    lower: Array
    upper: Array
    labels: tuple[tuple[str, int], ...]

    def excess(self, free: Array) -> Array:
        """How far each row is from its bounds, as a fraction of half their distance.

        Args:
            free: free coefficients, (n, K).

        Returns:
            (n, R): 0 on a bound, above 0 beyond it, -1 in the middle, -inf without a limit.
        """
        values = free @ self.matrix.T
        limited = np.isfinite(self.upper)
        half = np.where(limited, (self.upper - np.where(limited, self.lower, 0.0)) / 2.0, 1.0)
        centre = np.where(limited, self.upper - half, 0.0)
        return np.where(limited, np.abs(values - centre) / half - 1.0, -np.inf)

    def working_set(self, free: Array, within: float = 0.1) -> NDArray[np.bool_]:
        """Marks the rows that a solver has to see: passed, or near their bounds.

        Args:
            free: free coefficients, (n, K).
            within: how near, as a fraction of half the distance of the bounds.

        Returns:
            (n, R), true where the row belongs to the working set.
        """
        return self.excess(free) > -within

    def largest_step(self, free: Array, direction: Array) -> float:
        """The largest factor s >= 0 for which free + s direction keeps every row.

        Args:
            free: free coefficients that keep every row, (n, K).
            direction: (n, K).

        Returns:
            The factor; infinite where no limit is met, 0 where `free` is already at a bound that lies ahead.
        """
        return max(0.0, float(self.room(free, direction).min()))

    def room(self, free: Array, direction: Array) -> Array:
        """The largest factor of each joint's own direction that keeps its rows.

        Args:
            free: free coefficients that keep every row, (n, K).
            direction: (n, K).

        Returns:
            (n,); infinite where a joint meets no limit.
        """
        values, slope = free @ self.matrix.T, direction @ self.matrix.T
        with np.errstate(divide="ignore", invalid="ignore"):
            room = np.where(slope > 0.0, self.upper - values, self.lower - values) / slope
        return np.where(slope == 0.0, np.inf, room).min(axis=1, initial=np.inf)


def kinematic_rows(
    basis: Sequence[Array], limits: Limits, *, shares: Sequence[float], quantities: Sequence[str] = QUANTITIES
) -> KinematicRows:
    """Writes the kinematic limits as rows that, kept at the samples, hold at all times.

    Args:
        basis: matrices (M, K) from free coefficients to q, dq, ddq, dddq at M evenly spaced times.
        limits: bounds of all joints; infinite ones give no row where no joint has one.
        shares: to which the bounds of q, dq, ddq and dddq shrink, so that they hold between the times, too
            (`tightened_bounds`).
        quantities: which of `q`, `dq`, `ddq`, `dddq` to limit.

    Returns:
        The rows, quantity by quantity, sample by sample.

    Raises:
        InfeasibleError: a joint with a limit of zero.
        InputError: an unknown quantity, or a limit on one side only.
    """
    bounds = {
        "q": (limits.lower, limits.upper),
        "dq": (-limits.velocity, limits.velocity),
        "ddq": (-limits.acceleration, limits.acceleration),
        "dddq": (-limits.jerk, limits.jerk),
    }
    samples, joints = basis[0].shape[0], limits.lower.size
    blocks: list[Array] = []
    lower: list[Array] = []
    upper: list[Array] = []
    labels: list[tuple[str, int]] = []
    for quantity in quantities:
        if quantity not in bounds:
            raise InputError(f"found the quantity {quantity!r}", allowed=", ".join(QUANTITIES))
        low, high = bounds[quantity]
        if np.any(high - low <= 0.0):
            joint = int(np.argmax(high - low <= 0.0)) + 1
            raise InfeasibleError(f"the limit of {quantity} leaves no room to move", joint=joint)
        low, high = tightened_bounds(low, high, shares[QUANTITIES.index(quantity)])
        if not np.any(np.isfinite(high)):
            continue
        blocks.append(basis[QUANTITIES.index(quantity)])
        lower.append(np.repeat(low[:, None], samples, axis=1))
        upper.append(np.repeat(high[:, None], samples, axis=1))
        labels += [(quantity, index) for index in range(samples)]
    columns = basis[0].shape[1]
    return KinematicRows(
        matrix=np.vstack([np.zeros((0, columns)), *blocks]),
        lower=np.hstack([np.zeros((joints, 0)), *lower]),
        upper=np.hstack([np.zeros((joints, 0)), *upper]),
        labels=tuple(labels),
    )
