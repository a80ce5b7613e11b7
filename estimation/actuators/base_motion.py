"""The motion of a robot's base, from columns of its pose: what it adds to gravity, and how it turns."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from estimation.logs.formats import read_foreign
from estimation.preprocessing.resampling import resample
from estimation.preprocessing.smoothing import smooth
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.drives import Situation
from robots.robot import Robot
from robots.signals import Log
from robots.terms.situations.flange_body import require_flange
from robots.terms.situations.sensitivities import moved_body

POSE = "base_pose"
"""Where a log's metadata have the columns of its base."""
BASE = re.compile(r"(base|root|pelvis|torso|trunk|imu)", re.IGNORECASE)
"""Names of columns that say something of the base."""
HELD = 0.02
"""Standard deviation of a base's pose [m or rad or 1] up to which it counts as held."""
POSITION, QUATERNION, ANGLES = (
    tuple(f"base_{name}" for name in names) for names in ("xyz", ("qx", "qy", "qz", "qw"), ("roll", "pitch", "yaw"))
)
CUTOFF, HIGHEST = 0.1, 20.0
"""Cut-off of the base's motion as a share of the sampling rate, and its largest value [Hz]."""


def with_base(log: Log) -> Log:
    """Reads the pose of the base from the log's own file, if that has columns of it.

    Args:
        log: as it was read. One with `base_pose` in its metadata, columns by name, stays as it is.

    Raises:
        InputError: columns that show a base that moves, but not its whole orientation.
    """
    file = log.metadata.get("file")
    ignored = [name for name in log.metadata.get("ignored_columns", ()) if BASE.search(name)]
    if POSE in log.metadata or not ignored or file is None:
        return log
    try:
        table = read_foreign(file, lambda name: name in ignored)
    except InputError:
        return log
    columns = {name: values for name, values in table.columns.items() if not table.is_text(name)}
    moving = next((name for name, values in columns.items() if float(np.nanstd(values)) > HELD), None)
    if moving is None:
        return log
    known = all(name in columns for name in QUATERNION) or all(name in columns for name in ANGLES)
    whole = known and all(len(values) == len(log) and np.isfinite(values).all() for values in columns.values())
    if not whole:
        raise InputError(
            f"the base moves (standard deviation {np.nanstd(columns[moving]):.2g})",
            file=file,
            column=moving,
            allowed=f"a base that is held, or its pose in every row: {', '.join(POSITION)} [m] and "
            f"{', '.join(QUATERNION)}, or {', '.join(ANGLES)} [rad]",
            remedy="hang or clamp the robot, or log the pose; contacts with the ground are not part of the model",
        )
    return replace(log, metadata={**log.metadata, POSE: columns})


def is_situated(log: Log) -> bool:
    """Whether a log has a payload, or a base that moves or stands otherwise than described."""
    return log.payload is not None or log.gravity is not None or POSE in log.metadata


def situation_of(log: Log, robot: Robot) -> Situation:
    """Gives payload and base motion of a log.

    Args:
        log: the log, see `with_base`.
        robot: the chain.

    Raises:
        InputError: a payload of a robot whose flange is not known.
    """
    usual = Situation.usual(robot)
    gravity = np.asarray(robot.chain.gravity if log.gravity is None else log.gravity, dtype=float)
    body = usual.body
    if log.payload is not None:
        require_flange(robot)
        body = np.asarray(moved_body(robot.chain.tip) @ log.payload, dtype=float)
    pose: Mapping[str, Array] | None = log.metadata.get(POSE)
    if pose is None:
        return replace(usual, base=np.concatenate([-gravity, np.zeros(6)])[None], body=body)
    return Situation(t=log.t, base=base_motion(log.t, pose, gravity), body=body)


def base_motion(t: Array, pose: Mapping[str, Array], gravity: Array) -> Array:
    """Works out the motion of a base in its own frame.

    Args:
        t: times (N,) [s].
        pose: columns by name: `base_x`, `base_y`, `base_z` [m], and `base_qx` to `base_qw`, or `base_roll`,
            `base_pitch`, `base_yaw` [rad], about fixed axes x, y, z. Without a position it is at rest.
        gravity: acceleration (3,) [m/s2] in the frame of the pose.

    Returns:
        Acceleration less gravity [m/s2], angular velocity [rad/s] and acceleration [rad/s2] (N, 9).
    """
    if all(name in pose for name in QUATERNION):
        turned = Rotation.from_quat(np.column_stack([pose[name] for name in QUATERNION]))
    else:
        turned = Rotation.from_euler("xyz", np.column_stack([pose[name] for name in ANGLES]))
    rate = (len(t) - 1) / (t[-1] - t[0])
    cutoff = min(CUTOFF * rate, HIGHEST)
    # One sign of the quaternions, so that they are smooth.
    quaternions = turned.as_quat()
    flips = np.sign(np.sum(quaternions[1:] * quaternions[:-1], axis=1))
    quaternions[1:] *= np.cumprod(np.where(flips == 0, 1.0, flips))[:, None]
    x = np.column_stack([pose.get(name, np.zeros(len(t))) for name in POSITION])
    motion = smooth(resample(t, np.column_stack([x, quaternions])), cutoff)
    turned = Rotation.from_quat(motion.q[:, 3:])
    size = np.linalg.norm(motion.q[:, 3:], axis=1, keepdims=True)
    omega = 2 * _times_conjugate(motion.q[:, 3:] / size, motion.dq[:, 3:] / size)
    alpha = 2 * _times_conjugate(motion.q[:, 3:] / size, motion.ddq[:, 3:] / size)
    acceleration = turned.inv().apply(motion.ddq[:, :3] - gravity)
    found = np.column_stack([acceleration, omega, alpha])
    return np.column_stack([np.interp(t, motion.t, column) for column in found.T])


def _times_conjugate(q: Array, rate: Array) -> Array:
    """Vector part of conj(q) rate (N, 3), scalars last: half the angular velocity in the body's frame."""
    v, w = q[:, :3], q[:, 3:]
    u, s = rate[:, :3], rate[:, 3:]
    return np.asarray(w * u - s * v - np.cross(v, u))
