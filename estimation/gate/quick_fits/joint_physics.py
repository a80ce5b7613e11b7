"""Inertia and friction power of a joint, by its quick fit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.gate.quick_fits.joint_fit import OWN, JointFit, Rows
from estimation.gate.quick_fits.rigid_body import joint_rows
from robots.robot import Robot

Array = NDArray[np.float64]

# Poses at which the inertia that a joint feels is averaged.
POSES = 64


@dataclass(frozen=True, eq=False)
class JointPhysics:
    """Inertia and friction power of a joint, by its quick fit.

    Attributes:
        inertia: mean of the diagonal of the mass matrix over the log's poses, with rotor [kg m2 or kg].
        inertia_error: its standard error.
        loss: mean power that friction takes [W].
        loss_error: its standard error.
        power: mean absolute power [W].
    """

    inertia: float
    inertia_error: float
    loss: float
    loss_error: float
    power: float

    @property
    def ratios(self) -> tuple[float, float]:
        """Inertia and friction over their standard errors."""
        tiny = np.finfo(float).tiny
        return self.inertia / max(self.inertia_error, tiny), self.loss / max(self.loss_error, tiny)

    @property
    def information(self) -> float:
        """The larger of the two ratios: whether the log determines any of the joint's own parameters."""
        return float(np.abs(self.ratios).max())


def mean_inertias(robot: Robot, rows: Rows) -> list[Array]:
    """What a unit acceleration of each joint costs it, by the parameters that act on it: n arrays (k_j,).

    Args:
        robot: with n joints.
        rows: of the log, some of whose poses are averaged over.
    """
    poses = rows.q[:: max(1, len(rows.q) // POSES)]
    # Every joint in turn, and none: what is left is the mass matrix's diagonal.
    accelerations = np.vstack([np.eye(robot.n), np.zeros(robot.n)])
    q, ddq = np.tile(poses, (len(accelerations), 1)), np.repeat(accelerations, len(poses), axis=0)
    felt = joint_rows(robot, q, np.zeros_like(q), ddq)
    places = [slice(k * len(poses), (k + 1) * len(poses)) for k in range(len(accelerations))]
    return [(own[places[joint]] - own[places[-1]]).mean(axis=0) for joint, own in enumerate(felt)]


def joint_physics(rows: Rows, fit: JointFit, joint: int, felt: Array) -> JointPhysics:
    """Derives inertia and friction losses of a joint from its fit.

    Args:
        rows: of the log.
        fit: of the joint.
        joint: counted from 0.
        felt: of `mean_inertias` (k,).
    """
    weights = np.zeros(len(fit.scale))
    weights[: len(fit.used)] = felt
    weights[-OWN] = 1.0
    inertia, inertia_error = fit.combination(weights)
    own = fit.Y[:, -OWN:] * fit.scale[-OWN:]
    dq = rows.dq[:, joint]
    weights = np.zeros(len(fit.scale))
    weights[-OWN + 1 : -1] = (own[:, 1:3] * dq[:, None]).mean(axis=0)
    loss, loss_error = fit.combination(weights)
    power = float(np.mean(np.abs(dq * (fit.residual + fit.Y @ fit.values))))
    return JointPhysics(inertia, inertia_error, loss, loss_error, power)
