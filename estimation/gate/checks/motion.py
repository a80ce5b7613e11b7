"""Motions that are not what an arm does, or too small."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from estimation.gate.context import Context
from estimation.gate.finding import Finding
from estimation.recordings.rows.motion import HARDLY, travel_shares
from estimation.recordings.rows.wraps import Wraps
from robots.common.arrays import Array
from robots.common.plain import percent, several
from robots.common.stretches import spans
from robots.robot import Robot


def travel(context: Context) -> list[Finding]:
    """Finds joints with a small travel."""
    robot, columns = context.robot, context.recorded.columns
    travel, share = columns.travel, travel_shares(robot, columns.extremes)
    if not (travel > 0).any():
        return [
            Finding(
                name="no_motion",
                severity="refuse",
                text="no joint moves",
                action="record a log in which the arm moves",
                value=0.0,
                unit="rad or m",
                column="q1",
            )
        ]
    return [
        Finding(
            name="hardly_moves",
            severity="warning",
            text=f"{robot.joint_names[joint]} moves by {travel[joint]:.3g}, {percent(share[joint])} of its range",
            action="this log does not determine inertia and friction of this joint: move it further",
            value=float(travel[joint]),
            unit="rad or m",
            column=f"q{joint + 1}",
            joint=int(joint) + 1,
        )
        for joint in np.flatnonzero(share < HARDLY)
    ]


# Speed over its limit from which it is reported.
TOO_FAST = 2.0


def speeds(context: Context) -> list[Finding]:
    """Finds the joint that exceeds its speed limit most: the time, or the unit of the position, may be wrong."""
    limit = np.asarray(context.robot.limits.velocity)
    known = np.isfinite(limit) & (limit > 0)
    if not known.any():
        return []
    peak = context.smoothed.peak_speeds
    ratio = np.where(known, peak / np.where(known, limit, 1.0), 0.0)
    worst = int(np.argmax(ratio))
    if not ratio[worst] >= TOO_FAST:
        return []
    return [
        Finding(
            name="too_fast",
            severity="warning",
            text=f"reaches a speed of {peak[worst]:.3g}, {ratio[worst]:.3g} times the limit in the robot's description",
            action="check the units of t and q, and that the log belongs to this robot",
            value=float(peak[worst]),
            unit="rad/s or m/s",
            column=f"q{worst + 1}",
            joint=worst + 1,
        )
    ]


Rows = NDArray[np.intp]

# A step is a jump above so many times the 99th percentile of the steps and this share of the travel, ...
LARGE_STEP, LEAST_TRAVEL = 3.0, 0.005
# ... and above so many times all other steps within so many rows: messages that come twice make steps of up to four.
LARGE_BESIDE, WINDOW = 5.0, 10
# Most rows of one jump: one row may lie between the old value and the new one.
ROWS_OF_A_JUMP = 2
# Share of large steps above which they are the motion.
COMMON = 0.01
# Number of steps from which the percentile is estimated.
SAMPLES = 20_000
# Share of the travel above which a jump would make a fit wrong.
REFUSED_TRAVEL = 0.05


def jumps(context: Context) -> list[Finding]:
    """Finds jumps of positions that are neither outliers of single rows nor beside a gap in time."""
    recorded = context.recorded
    known = np.concatenate([recorded.spikes, recorded.spikes + 1, recorded.timing.gaps + 1])
    # A lost message makes a longer step, and no jump.
    periods = np.maximum(recorded.timing.steps / recorded.timing.period, 1.0)
    findings = []
    for joint, q in enumerate(recorded.columns.q):
        # The position of a joint that stands changes by single encoder steps.
        if recorded.standing[joint]:
            continue
        rows = np.setdiff1d(jump_rows(periods, q), known)
        if len(rows):
            findings.append(_jump(joint, q, rows, float(recorded.columns.travel[joint])))
    return findings


def jump_rows(periods: Array, q: Array) -> Rows:
    """Finds the rows of a position (N,) before which it jumps: by one large step, without large ones around it.

    Args:
        periods: time steps (N - 1,) over their median, 1 at least.
        q: position (N,).
    """
    steps = np.abs(np.diff(q)) / periods
    usual = float(np.quantile(steps[:: max(1, len(steps) // SAMPLES)], 0.99))
    large = steps > max(LARGE_STEP * usual, LEAST_TRAVEL * float(q.max() - q.min()))
    if not large.any() or large.mean() > COMMON:
        return np.empty(0, dtype=np.intp)
    # A joint that stands for most of the log makes many large steps in a row when it accelerates.
    for start, stop in spans(large):
        large[start:stop] = stop - start <= ROWS_OF_A_JUMP
    around = maximum_filter1d(np.where(large, 0.0, steps), 2 * WINDOW + 1)
    return np.flatnonzero(large & (steps > LARGE_BESIDE * around)) + 1


def _jump(joint: int, q: Array, rows: Rows, travel: float) -> Finding:
    sizes = q[rows] - q[rows - 1]
    largest = int(np.argmax(np.abs(sizes)))
    return Finding(
        name="jump",
        severity="refuse" if abs(sizes[largest]) > REFUSED_TRAVEL * travel else "warning",
        text=f"jumps {several(len(rows), 'time')}, by up to {sizes[largest]:.4g} in one sample",
        action="cut the log there, and check the encoder and the logger",
        value=float(sizes[largest]),
        unit="rad or m",
        column=f"q{joint + 1}",
        joint=joint + 1,
        row=int(rows[largest]) + 1,
    )


def wrapped_angles(context: Context) -> list[Finding]:
    """Reports angles that wrap. Those of continuous joints were unwrapped; others are refused.

    All other checks see the unwrapped angles.
    """
    return [_wraps(context.robot, wraps) for wraps in context.recorded.wraps]


def _wraps(robot: Robot, wraps: Wraps) -> Finding:
    joint, count = wraps.joint, len(wraps.rows)
    low, high = float(robot.limits.lower[joint]), float(robot.limits.upper[joint])
    endless = robot.endless[joint] and wraps.turn < 10.0
    unit = "rad" if wraps.turn < 10.0 else "degrees"
    text = f"the angle wraps {several(count, 'time')}: it jumps by {wraps.turn:.4g} ({unit})"
    if endless:
        action = "it was unwrapped, because the joint is continuous"
    elif not np.isfinite(low + high):
        action = "unwrap the angle and set its unit (deg) in a mapping (--mapping)"
    else:
        first, last = float(wraps.q.min()), float(wraps.q.max())
        shift = wraps.turn * round(0.5 * (low + high - first - last) / wraps.turn)
        action = (
            f"unwrap the angle before the log is written (numpy.unwrap, and whole turns); it then runs from "
            f"{first + shift:.4g} to {last + shift:.4g}, and the robot's description allows {low:.4g} to {high:.4g}. "
            "If the joint turns without end, describe it as continuous"
        )
    return Finding(
        name="wrapped_angle",
        severity="info" if endless else "refuse",
        text=text,
        action=action,
        value=float(count),
        unit="wraps",
        column=f"q{joint + 1}",
        joint=joint + 1,
        row=int(wraps.rows[0]) + 1,
    )


# A row is in another pose than the one before if a joint has moved by this share of its travel in between.
OTHER = 0.01
# Median way between poses over the travel, at least: the steps of a coarse encoder are smaller.
FAR = 0.08
# Share of the way between poses up to which the arm may move in them, fewest poses, and fewest rows a pose; fewer are
# poses of one row each if neighbouring steps differ by more than they are large.
STILL, POSES, ROWS, ROUGH = 0.05, 5, 4, 1.0


def static_poses(context: Context) -> list[Finding]:
    """Finds logs in which the arm moves only where nothing is logged. They show gravity, and nothing else."""
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
