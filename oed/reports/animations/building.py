"""Animations of designed motions and of logs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from estimation.preprocessing import LowPass, resample, smooth
from oed.reports.animations.animation import Animation
from oed.reports.animations.bodies import bodies_of, checked_model
from robots.collision import Capsule, CollisionModel, Surroundings
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.limits import Margin, symmetric_margins
from robots.regressor import default_model
from robots.robot import Robot
from robots.signals import Log, Motion

RATE = 25.0
"""Frames per second of the motion; the page draws straight lines between them."""

FRAMES = 3000
"""Most frames of a page: 120 s at the full rate."""

APPROACHES = 8
"""Closest approaches in the page's table."""


def animate(
    robot: Robot,
    motion: Motion | Log,
    *,
    torque: Array | None = None,
    margins: Sequence[Margin] | None = None,
    marks: Mapping[int, str] | None = None,
    source: str = "",
    surroundings: Surroundings | None = None,
) -> Animation:
    """Makes the animation of a motion, or of the motion in a log.

    A log's positions are low-passed at 6 Hz before they are differentiated; its torque is that of the log. The torque
    of a motion is that of the robot's nominal dynamics, where its description has them.

    Args:
        robot: the robot.
        motion: N instants of its n joints.
        torque: (N, n) in place of that torque [N m or N].
        margins: the closest approaches to limits; measured on the motion by default, those to jerk limits left out of
            logs.
        marks: what is wrong with a joint, by its number from 1.
        source: what is played, in words; "motion" or "log" by default.
        surroundings: the floor, and boxes around the robot.

    Raises:
        InputError: another number of joints than the robot has, or a log of fewer than 20 rows.
    """
    if motion.n != robot.n:
        raise InputError(
            f"the motion has {motion.n} joints, {robot.name} has {robot.n}", remedy="choose the robot with --robot"
        )
    measured = isinstance(motion, Log)
    if isinstance(motion, Log):
        torque = motion.tau if torque is None else torque
        motion = _smoothed(motion)
    elif torque is None:
        torque = _nominal(robot, motion)
    if margins is None:
        margins = [m for m in robot.limits.margins(motion) if not (measured and m.quantity == "jerk")]
        if torque is not None:
            margins = [*margins, *symmetric_margins("torque", motion.t, torque, robot.limits.torque)]
    rows = _frames(motion.t)
    q = motion.q[rows]
    return Animation(
        robot=robot.title or robot.name,
        chain=robot.chain,
        limits=robot.limits,
        bodies=bodies_of(robot, surroundings),
        t=motion.t[rows],
        q=q,
        shares=_shares(robot, motion, torque, rows),
        path=robot.chain.flange(q)[:, :3, 3],
        approaches=tuple(
            sorted((m for m in margins if np.isfinite(m.limit)), key=lambda m: m.slack_fraction)[:APPROACHES]
        ),
        marks=dict(marks or {}),
        source=source or ("log" if measured else "motion"),
        meetings=_meetings(checked_model(robot, surroundings), q),
    )


def _meetings(model: CollisionModel | None, q: Array) -> dict[int, tuple[int, ...]]:
    """By frame, what meets by the collision model: links, 0 for the base, -1 for floor and obstacles."""
    if model is None or not model.pairs:
        return {}
    meet = model.clearance(q) < 0.0
    links = [{pair.first.link if isinstance(pair.first, Capsule) else -1, pair.second.link} for pair in model.pairs]
    return {
        int(frame): tuple(sorted(set().union(*(links[k] for k in np.flatnonzero(meet[frame])))))
        for frame in np.flatnonzero(meet.any(axis=1))
    }


def _smoothed(log: Log) -> Motion:
    grid = resample(log.t, log.q)
    # The Nyquist frequency of slow logs is below 6 Hz.
    return smooth(grid, LowPass(min(6.0, 0.2 / float(np.median(np.diff(log.t))))))


def _nominal(robot: Robot, motion: Motion) -> Array | None:
    if not np.isfinite(robot.limits.torque).any() or not robot.has_inertia:
        return None
    model = default_model(robot)
    if not model.described:
        return None
    return np.asarray(model.torque(motion.q, motion.dq, motion.ddq, model.nominal))


def _frames(t: Array) -> NDArray[np.intp]:
    """Rows of the frames (F,): the first, the last, and between them those next to an even grid."""
    count = int(min(max(np.ceil((t[-1] - t[0]) * RATE), 1), FRAMES - 1)) + 1
    grid = np.linspace(t[0], t[-1], count)
    after = np.clip(np.searchsorted(t, grid), 0, len(t) - 1)
    before = np.maximum(after - 1, 0)
    return np.unique(np.where(grid - t[before] < t[after] - grid, before, after))


def _shares(robot: Robot, motion: Motion, torque: Array | None, rows: NDArray[np.intp]) -> dict[str, Array]:
    limits = robot.limits
    span = limits.upper - limits.lower
    # As margins have it: the distance to a limit is divided by the range, or by the limit where the other is open.
    ends = []
    for slack, limit in ((motion.q - limits.lower, limits.lower), (limits.upper - motion.q, limits.upper)):
        scale = np.where(np.isfinite(span), span, np.maximum(np.abs(limit), 1.0))
        with np.errstate(invalid="ignore"):
            ends.append(np.where(np.isfinite(limit), 1.0 - slack / scale, -np.inf))
    position = np.maximum(*ends)
    found = {"position": np.where(np.isfinite(position), position, np.nan)}
    signals = {"velocity": (motion.dq, limits.velocity), "acceleration": (motion.ddq, limits.acceleration)}
    if torque is not None:
        signals["torque"] = (torque, limits.torque)
    for name, (values, limit) in signals.items():
        known = np.isfinite(limit) & (limit > 0.0)
        found[name] = np.where(known, np.abs(values) / np.where(known, limit, 1.0), np.nan)
    # The largest since the last frame, so that no peak falls between two frames.
    starts = np.concatenate([[0], rows[:-1] + 1])
    return {
        name: np.maximum.reduceat(values, starts, axis=0) for name, values in found.items() if np.isfinite(values).any()
    }
