"""The regressor of the rigid body and its gravity, joint by joint, for the few thousand rows of a quick fit."""

from __future__ import annotations

from functools import lru_cache

import casadi
import numpy as np
from numpy.typing import NDArray

from robots.batch import BatchFunction, batch_function
from robots.common.arrays import Array
from robots.regressor import TorqueModel
from robots.robot import Robot
from robots.terms import RigidBody

# Parameters of a link; gravity acts on the first four, mass and first moments.
LINK, HEAVY = 10, 4


@lru_cache(maxsize=8)
def rigid_body(robot: Robot) -> TorqueModel:
    """Gives the rigid body of a robot. It is cached: to build it takes longer than to check a short log."""
    return TorqueModel(robot, (RigidBody(),))


def used_columns(robot: Robot) -> tuple[NDArray[np.intp], ...]:
    """Lists the parameters of the rigid body that act on each joint: n arrays of indices."""
    return _evaluator(robot)[1]


def joint_rows(robot: Robot, q: Array, dq: Array, ddq: Array) -> tuple[Array, ...]:
    """Evaluates the columns that act on each joint, of the links from itself outwards: n arrays (M, k_j)."""
    rows = _evaluator(robot)[0](q, dq, ddq)
    return tuple(part.reshape(len(q), -1) for part in rows)


@lru_cache(maxsize=8)
def _evaluator(robot: Robot) -> tuple[BatchFunction, tuple[NDArray[np.intp], ...]]:
    symbolic = rigid_body(robot).symbolic()
    rows, columns = (np.asarray(part) for part in symbolic.sparsity_out(0).get_triplet())
    used = tuple(np.sort(columns[rows == joint]).astype(np.intp) for joint in range(robot.n))
    inputs = [casadi.SX.sym(name, robot.n) for name in ("q", "dq", "ddq")]
    Y = symbolic(*inputs)
    parts = [casadi.densify(Y[joint, columns.tolist()]) for joint, columns in enumerate(used)]
    return batch_function(casadi.Function("joint_rows", inputs, parts)), used


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
