"""Rigid-body torque of many samples, and the projection of torques off a base model of rigid body and friction."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from scipy.linalg import eigh


def rigid_torque(model: pin.Model, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Computes the inverse dynamics (N, n) [N m] by the recursive Newton-Euler algorithm."""
    data = model.createData()
    torque = np.empty_like(q)
    for k in range(len(q)):
        torque[k] = pin.rnea(model, data, q[k], v[k], a[k])
    return torque


def with_gravity(model: pin.Model, gravity: np.ndarray) -> pin.Model:
    """Returns a copy of the model under another gravity (3,) [m/s2]."""
    copy = pin.Model(model)
    copy.gravity.linear = np.asarray(gravity, dtype=float)
    return copy


def with_tool(model: pin.Model, tool: pin.Inertia) -> pin.Model:
    """Returns a copy of the model with an additional rigid body on the last link."""
    copy = pin.Model(model)
    copy.inertias[copy.njoints - 1] += tool
    return copy


def massless(model: pin.Model) -> pin.Model:
    """Returns a copy of the model whose links have no mass."""
    copy = pin.Model(model)
    for joint in range(1, copy.njoints):
        copy.inertias[joint] = pin.Inertia.Zero()
    return copy


def point_force_torque(model: pin.Model, q: np.ndarray, joint: int, point: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Computes the joint torque (N, n) that balances a force (N, 3), in base axes, on a point of a joint's link."""
    data = model.createData()
    torque = np.zeros_like(q)
    for k in np.flatnonzero(np.any(force, axis=1)):
        pin.computeJointJacobians(model, data, q[k])
        jacobian = pin.getJointJacobian(model, data, joint, pin.LOCAL_WORLD_ALIGNED)
        arm = data.oMi[joint].rotation @ point
        torque[k] = -(jacobian[:3].T @ force[k] + jacobian[3:].T @ np.cross(arm, force[k]))
    return torque


def base_regressor(model: pin.Model, q: np.ndarray, v: np.ndarray, a: np.ndarray, sign: np.ndarray) -> np.ndarray:
    """Regressor (N, n, p) of links, friction polynomial (with a smooth and a sharp sign), rotors and torque offsets."""
    n = model.nv
    data = model.createData()
    Y = np.zeros((len(q), n, 17 * n))
    for k in range(len(q)):
        Y[k, :, : 10 * n] = pin.computeJointTorqueRegressor(model, data, q[k], v[k], a[k])
    for j in range(n):
        first, s = 10 * n + 7 * j, v[:, j]
        extra = (sign[:, j], np.sign(s), s, s * np.abs(s), s**3, a[:, j], np.ones(len(v)))
        Y[:, j, first : first + 7] = np.column_stack(extra)
    return Y


class Projection:
    """Projection of torques off a base regressor, with joints weighted by the inverse of their torque RMS."""

    def __init__(self, Y: np.ndarray, level: np.ndarray) -> None:
        self.level = level
        self.Y = Y / level[None, :, None]
        flat = self.Y.reshape(-1, Y.shape[2])
        size = np.sqrt((flat**2).sum(axis=0))
        self.scale = np.where(size > 0, size, 1.0)
        values, vectors = eigh((flat / self.scale).T @ (flat / self.scale))
        # Directions with less of the largest eigenvalue of the regressor's Gram matrix count as not excited.
        keep = values > 1e-12 * values[-1]
        self.inverse = (vectors[:, keep] / values[keep]) @ vectors[:, keep].T

    def fit(self, torque: np.ndarray) -> np.ndarray:
        """Estimates the least-squares parameters (p,) of a torque (N, n)."""
        flat = self.Y.reshape(-1, self.Y.shape[2]) / self.scale
        return (self.inverse @ (flat.T @ (torque / self.level).reshape(-1))) / self.scale

    def rest(self, torque: np.ndarray) -> np.ndarray:
        """Computes the residual of a torque (N, n) after the fit of the base model, in the torque's unit."""
        return torque - (self.Y @ self.fit(torque)) * self.level

    def visible(self, torque: np.ndarray) -> np.ndarray:
        """Computes the residual's RMS per joint (n,), as a fraction of the joint's torque RMS."""
        return np.sqrt((self.rest(torque) ** 2).mean(axis=0)) / self.level
