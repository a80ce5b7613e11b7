"""The rival: what an engineer writes in an hour with pinocchio, numpy and scipy. Nothing of this project is used."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

Array = NDArray[np.float64]

# Cut-off [Hz] of the zero-phase Butterworth filter, and its order.
CUTOFF, ORDER = 10.0, 4
# Width [rad/s or m/s] over which the Coulomb friction's sign is smoothed.
SIGN_WIDTH = 0.01


def build_model(joints: Sequence[tuple[str, Array, Array, Array]], gravity: Array) -> pin.Model:
    """Builds a chain without bodies: kind (``revolute`` or ``prismatic``), rotation, translation and axis of each."""
    model, parent = pin.Model(), 0
    for k, (kind, rotation, translation, axis) in enumerate(joints):
        joint = pin.JointModelRevoluteUnaligned if kind == "revolute" else pin.JointModelPrismaticUnaligned
        parent = model.addJoint(parent, joint(axis), pin.SE3(rotation, translation), f"joint{k}")
    model.gravity.linear = gravity
    return model


def derivatives(t: Array, q: Array) -> tuple[Array, Array, Array, Array]:
    """Puts positions on an even grid, low-passes them, and differentiates: t, q, dq, ddq."""
    step = float(np.median(np.diff(t)))
    grid = t[0] + step * np.arange(int((t[-1] - t[0]) / step + 1e-6) + 1)
    even = np.column_stack([np.interp(grid, t, column) for column in q.T])
    smooth = sosfiltfilt(_filter(step), even, axis=0)
    dq = np.gradient(smooth, step, axis=0)
    return grid, smooth, dq, np.gradient(dq, step, axis=0)


def regressor(model: pin.Model, q: Array, dq: Array, ddq: Array) -> Array:
    """Evaluates (N, n, p): rigid bodies, Coulomb and viscous friction, offset."""
    n, data = model.nv, model.createData()
    Y = np.zeros((len(q), n, 13 * n))
    for row, state in enumerate(zip(q, dq, ddq, strict=True)):
        Y[row, :, : 10 * n] = pin.computeJointTorqueRegressor(model, data, *state)
    for j in range(n):
        Y[:, j, 10 * n + 3 * j] = np.tanh(dq[:, j] / SIGN_WIDTH)
        Y[:, j, 10 * n + 3 * j + 1] = dq[:, j]
        Y[:, j, 10 * n + 3 * j + 2] = 1.0
    return Y


def fit(model: pin.Model, logs: Sequence[tuple[Array, Array, Array]]) -> Array:
    """Fits parameters to logs of t, q and tau by least squares, each joint weighted by its residual."""
    blocks: list[tuple[Any, Any]] = []
    for t, q, tau in logs:
        grid, *state = derivatives(t, q)
        torque = np.column_stack([np.interp(grid, t, column) for column in tau.T])
        step = float(grid[1] - grid[0])
        blocks.append((regressor(model, *state), sosfiltfilt(_filter(step), torque, axis=0)))
    Y, tau = (np.concatenate(part) for part in zip(*blocks, strict=True))
    weights = 1.0 / np.maximum(tau.std(axis=0), 1e-9)
    for _ in range(2):
        A, b = (Y * weights[:, None]).reshape(-1, Y.shape[2]), (tau * weights).ravel()
        values = np.linalg.lstsq(A, b, rcond=1e-9)[0]
        weights = 1.0 / np.maximum((tau - Y @ values).std(axis=0), 1e-9)
    return np.asarray(values)


def predict(model: pin.Model, values: Array, t: Array, q: Array) -> Array:
    """Predicts the torque (N, n) at the samples of a log."""
    grid, *state = derivatives(t, q)
    torque = regressor(model, *state) @ values
    return np.column_stack([np.interp(t, grid, column) for column in torque.T])


def _filter(step: float) -> Array:
    return np.asarray(butter(ORDER, min(2 * step * CUTOFF, 0.9), output="sos"))
