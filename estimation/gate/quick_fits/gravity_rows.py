"""Torques of gravity per parameter of the rigid body, for each direction of gravity."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robots.robot import Robot

Array = NDArray[np.float64]

# Parameters of a link; gravity acts on the first four, mass and first moments.
LINK, HEAVY = 10, 4


def gravity_rows(robot: Robot, q: Array) -> Array:
    """Evaluates the torque of gravity per component of gravity and per parameter.

    A link of mass m and first moment c (in its frame, at p with rotation R) has the potential energy
    ``-g . (m p + R c)``. The torque of a joint is its derivative by the joint's position.

    Args:
        robot: with n joints.
        q: positions (M, n) [rad or m].

    Returns:
        (n, M, 3, 10 n): per unit of gravity in x, y, z of the base frame [m/s2]; zero for links before the joint.
    """
    rows, n = q.shape
    frame = np.tile(np.eye(4), (rows, 1, 1))
    moved, origins, axes = np.zeros((n, rows, 3, HEAVY)), np.zeros((n, rows, 3)), []
    for j, joint in enumerate(robot.chain.joints):
        frame = frame @ joint.transform(q[:, j])
        origins[j], moved[j, :, :, 1:] = frame[:, :3, 3], frame[:, :3, :3]
        axes.append(frame[:, :3, :3] @ np.asarray(joint.axis))
    result = np.zeros((n, rows, 3, n, LINK))
    for j, joint in enumerate(robot.chain.joints):
        if joint.kind == "revolute":
            moved[j:, :, :, 0] = origins[j:] - origins[j]
            turned = np.cross(axes[j][None, :, :, None], moved[j:], axis=2)
            result[j, :, :, j:, :HEAVY] = -turned.transpose(1, 2, 0, 3)
        else:
            result[j, :, :, j:, 0] = -axes[j][:, :, None]
    return result.reshape(n, rows, 3, LINK * n)
