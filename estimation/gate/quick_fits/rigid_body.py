"""The regressor of the rigid body, joint by joint, for the few thousand rows of a quick fit."""

from __future__ import annotations

from functools import lru_cache

import casadi
import numpy as np
from numpy.typing import NDArray

from robots.batch import BatchFunction, batch_function
from robots.regressor import TorqueModel
from robots.robot import Robot
from robots.terms import RigidBody

Array = NDArray[np.float64]


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
