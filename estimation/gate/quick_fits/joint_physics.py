"""Inertia and friction power of a joint, from its quick fit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimation.gate.quick_fits.joint_columns import OWN
from estimation.gate.quick_fits.joint_fit import JointFit, Rows
from estimation.gate.quick_fits.rigid_body import joint_rows, rigid_body, used_columns
from robots.common.arrays import Array
from robots.robot import Robot

# Number of poses over which the inertia is averaged.
POSES = 64
# Share of the described torque's energy that must remain without friction and offset.
REMAINS = 1e-4


@dataclass(frozen=True, eq=False)
class JointPhysics:
    """Inertia and friction power of a joint, from its quick fit.

    Attributes:
        inertia: mean of the diagonal of the mass matrix over the log's poses, with rotor [kg m2 or kg].
        inertia_error: its standard error.
        loss: mean power that friction dissipates [W].
        loss_error: its standard error.
        power: mean absolute power [W].
    """

    inertia: float
    inertia_error: float
    loss: float
    loss_error: float
    power: float

    @property
    def significances(self) -> tuple[float, float]:
        """Inertia and friction power over their standard errors."""
        tiny = np.finfo(float).tiny
        return self.inertia / max(self.inertia_error, tiny), self.loss / max(self.loss_error, tiny)

    @property
    def information(self) -> float:
        """The larger absolute significance: whether the log determines inertia or friction of the joint."""
        return float(np.abs(self.significances).max())


def mean_inertias(robot: Robot, rows: Rows) -> Array:
    """Gives the mean inertia of each joint as a linear combination of the rigid body's parameters.

    It is the diagonal of the mass matrix, from unit accelerations of one joint at a time.

    Args:
        robot: with n joints.
        rows: of the log, from which poses are taken.

    Returns:
        Weights of the parameters, one row a joint (n, p).
    """
    poses = rows.q[:: max(1, len(rows.q) // POSES)]
    # The last one is zero: its torque is gravity alone, and is subtracted.
    accelerations = np.vstack([np.eye(robot.n), np.zeros(robot.n)])
    q, ddq = np.tile(poses, (len(accelerations), 1)), np.repeat(accelerations, len(poses), axis=0)
    columns = joint_rows(robot, q, np.zeros_like(q), ddq)
    places = [slice(k * len(poses), (k + 1) * len(poses)) for k in range(len(accelerations))]
    weights = np.zeros((robot.n, rows.bodies))
    for joint, (own, used) in enumerate(zip(columns, used_columns(robot), strict=True)):
        weights[joint, used] = (own[places[joint]] - own[places[-1]]).mean(axis=0)
    return weights


def joint_physics(rows: Rows, fit: JointFit, joint: int, mean_inertia: Array) -> JointPhysics:
    """Derives inertia and friction power of a joint from its fit.

    Args:
        rows: of the log.
        fit: of the joint.
        joint: counted from 0.
        mean_inertia: weights of the rigid body's parameters, from `mean_inertias` (p,).
    """
    weights = np.zeros(len(fit.scale))
    weights[: len(fit.used)] = mean_inertia[fit.used]
    weights[-OWN] = 1.0
    inertia, inertia_error = fit.combination(weights)
    own = fit.Y[:, -OWN:] * fit.scale[-OWN:]
    dq = rows.dq[fit.counted, joint]
    weights = np.zeros(len(fit.scale))
    weights[-OWN + 1 : -1] = (own[:, 1:3] * dq[:, None]).mean(axis=0)
    loss, loss_error = fit.combination(weights)
    power = float(np.mean(np.abs(dq * (fit.residual + fit.Y @ fit.values))))
    return JointPhysics(inertia, inertia_error, loss, loss_error, power)


def described_ratio(robot: Robot, fit: JointFit) -> tuple[float, float] | None:
    """Gives the factor between a torque and the described one, and their correlation; None without described links.

    Rotor inertia, friction and offset are no part of the described links: what they can explain is left out.
    """
    if not robot.has_masses:
        return None
    described = rigid_body(robot).nominal
    tau = fit.Y @ fit.values + fit.residual
    own = fit.Y[:, -OWN:]
    expected = fit.Y[:, :-OWN] @ (fit.scale[:-OWN] * described[fit.used])
    both = np.column_stack([expected, tau])
    both = both - own @ np.linalg.lstsq(own, both, rcond=None)[0]
    model, rest = both.T
    if not model @ model > REMAINS * (expected @ expected) or not rest @ rest > 0:
        return None
    product = model @ rest
    return float(product / (model @ model)), float(product / np.sqrt((model @ model) * (rest @ rest)))
