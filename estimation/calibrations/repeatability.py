"""The repeatability floor: how far measurements of one pose lie apart when it is visited again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robots.geometry_errors.poses import MeasuredPoses

Array = NDArray[np.float64]

SAME = 1e-3
"""Positions that are one pose [rad or m]: controllers stop within a few encoder counts of it."""


@dataclass(frozen=True, kw_only=True)
class Repeatability:
    """Spread of repeated poses.

    Attributes:
        error: root mean square distance from the mean of each pose's visits, in the measurement's first unit.
        poses: that were visited more than once.
        visits: of them.
    """

    error: float
    poses: int
    visits: int


def repeatability(poses: MeasuredPoses, residual: Array, used: NDArray[np.bool_]) -> Repeatability | None:
    """Finds the spread of the residuals of poses that were visited more than once; None if there are none.

    Residuals take out what the joints did not repeat, as far as encoders saw it.

    Args:
        poses: N measured poses.
        residual: (N, r).
        used: which count (N,).
    """
    groups: list[list[int]] = []
    for row in np.flatnonzero(used):
        near = next((g for g in groups if np.abs(poses.q[g[0]] - poses.q[row]).max() < SAME), None)
        if near is None:
            groups.append([int(row)])
        else:
            near.append(int(row))
    again = [group for group in groups if len(group) > 1]
    if not again:
        return None
    square, freedom = 0.0, 0
    for group in again:
        own = residual[group]
        errors = poses.measurement.error(own - np.nanmean(own, axis=0))
        square += float(np.nansum(errors**2))
        freedom += len(group) - 1
    return Repeatability(
        error=float(np.sqrt(square / freedom)), poses=len(again), visits=sum(len(group) for group in again)
    )
