"""Splits a motion at its rests; each part can be retimed separately."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from robots.signals import Motion

REST = 1e-6
"""Velocity and acceleration over their largest magnitudes below which a joint rests."""

CONSISTENT = 1e-5
"""Difference of a step from what velocity and acceleration make of it [rad or m] above which they are of no use."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Stretch:
    """Samples from one rest to the next.

    Args:
        motion: the samples.
        smooth: whether it begins and ends without velocity and acceleration, and its derivatives belong to its
            positions: then its own timing is of use.
    """

    motion: Motion
    smooth: bool


def split_at_rests(motion: Motion) -> list[Stretch]:
    """Cuts a motion at samples where no joint has velocity or acceleration, and leaves out pauses.

    Args:
        motion: N samples of n joints.

    Returns:
        The stretches in order; one for a motion whose velocities do not belong to its positions; none for one that
        does not move.
    """
    if len(motion) < 2 or np.ptp(motion.q, axis=0).max() <= 1e-12:
        return []
    if not _consistent(motion):
        return [Stretch(motion=motion, smooth=False)]
    rests = _rests(motion)
    cuts = np.unique(np.concatenate([[0], np.flatnonzero(rests), [len(motion) - 1]]))
    return [
        Stretch(motion=motion.slice(a, b + 1), smooth=bool(rests[a] and rests[b]))
        for a, b in pairwise(cuts)
        if b - a > 1 or np.abs(motion.q[b] - motion.q[a]).max() > 1e-9
    ]


def _rests(motion: Motion) -> NDArray[np.bool_]:
    share = np.zeros(len(motion))
    for values in (motion.dq, motion.ddq):
        largest = np.abs(values).max(axis=0)
        share = np.maximum(share, (np.abs(values) / np.where(largest > 0.0, largest, 1.0)).max(axis=1))
    return share <= REST


def _consistent(motion: Motion) -> bool:
    h = np.diff(motion.t)[:, None]
    mean = (motion.dq[1:] + motion.dq[:-1]) / 2
    expected = h * mean - h**2 / 12 * np.diff(motion.ddq, axis=0)
    return bool(np.abs(np.diff(motion.q, axis=0) - expected).max() <= CONSISTENT)
