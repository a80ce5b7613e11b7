"""The repeatability floor: how far measurements of one pose lie apart when it is visited again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from robots.common.arrays import Array
from robots.geometry_errors.poses import MeasuredPoses

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
    rows = np.flatnonzero(used)
    numbers = connected_components(coo_array(_near(poses.q[rows])), directed=False)[1]
    groups = [rows[numbers == number] for number in np.flatnonzero(np.bincount(numbers) > 1)]
    if not groups:
        return None
    square, freedom = 0.0, 0
    for group in groups:
        own = residual[group]
        errors = poses.measurement.error(own - np.nanmean(own, axis=0))
        square += float(np.nansum(errors**2))
        freedom += len(group) - 1
    return Repeatability(error=float(np.sqrt(square / freedom)), poses=len(groups), visits=sum(map(len, groups)))


def _near(q: Array) -> tuple[Array, tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Pairs of poses that are one, each pose with itself too, as entries of a matrix."""
    pairs = KDTree(q).query_pairs(SAME, p=np.inf, output_type="ndarray")
    itself = np.arange(len(q))
    first, second = (np.concatenate([itself, pairs[:, side]]) for side in (0, 1))
    return np.ones(len(first)), (first, second)
