"""Logs of poses that are held still."""

from __future__ import annotations

from itertools import pairwise
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding

Array = NDArray[np.float64]

# A row is in another pose than the one before if a joint has moved by this share of its travel in between.
OTHER = 0.01
# Median way between poses over the travel, at least: the steps of a coarse encoder are smaller.
FAR = 0.08
# Share of the way between poses up to which the arm may move in them, fewest poses, and fewest rows a pose; fewer are
# poses of one row each if neighbouring steps differ by more than they are large.
STILL, POSES, ROWS, ROUGH = 0.05, 5, 4, 1.0


class StaticPoses(Check):
    """Finds logs in which the arm moves only where nothing is logged. They show gravity, and nothing else."""

    name: ClassVar[str] = "static_poses"
    stage: ClassVar[Stage] = Stage.RECORDED
    order: ClassVar[int] = 15

    def run(self, context: Context) -> list[Finding]:
        """Compares the way in the poses with the way between them."""
        log = context.recorded.log
        poses = count_poses(log.q, log.t)
        if not poses:
            return []
        return [
            Finding(
                name="static_poses",
                severity="refuse",
                text=f"no joint moves while it is logged: {poses} static poses. They determine gravity only, neither "
                "inertias nor friction",
                action="log the motions as well, at 50 Hz or more",
                value=float(poses),
                unit="poses",
            )
        ]


def count_poses(q: Array, t: Array) -> int:
    """Counts the static poses of a log; 0 if the arm moves while it is logged.

    Args:
        q: positions (N, n).
        t: time (N,) [s].
    """
    travel = np.ptp(q, axis=0)
    moves = travel > 0
    if len(q) < POSES or not moves.any():
        return 0
    q = q[:, moves] / travel[moves]
    steps = np.abs(np.diff(q, axis=0)).max(axis=1)
    edges = np.concatenate([[0], np.flatnonzero(steps > OTHER) + 1, [len(q)]])
    poses = len(edges) - 1
    if poses < POSES or float(np.median(steps[edges[1:-1] - 1])) < FAR:
        return 0
    if len(q) < ROWS * poses:
        rough = np.abs(np.diff(q, n=2, axis=0)).sum() > ROUGH * np.abs(np.diff(q, axis=0)).sum()
        return poses if rough and poses > 0.9 * len(q) and float(np.median(np.diff(t))) >= 0.5 else 0
    way = steps[edges[1:-1] - 1].sum()
    inside = sum(float(np.ptp(q[a:b], axis=0).max()) for a, b in pairwise(edges))
    return poses if inside < STILL * way else 0
