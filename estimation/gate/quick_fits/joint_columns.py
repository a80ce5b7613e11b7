"""The regressor of one joint: columns of the rigid body, rotor, friction and offset."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.gate.quick_fits.rigid_body import gravity_rows
from robots.common.arrays import Array
from robots.robot import Robot

Places = NDArray[np.intp]

# Width of the smoothed sign(dq), over the joint's RMS speed.
SHARP = 0.05
# A column whose RMS is below this share of the joint's largest is rounding.
SILENT = 1e-12
# Number of a joint's own columns, after those of the rigid body: rotor inertia, Coulomb, viscous, offset.
OWN = 4


@dataclass(frozen=True, eq=False)
class JointColumns:
    """The regressor of one joint: columns of the rigid body, then its own.

    Attributes:
        Y: (M, k), scaled to unit mean square.
        scale: RMS of the unscaled columns (k,).
        used: parameters of the rigid body that the first columns belong to.
    """

    Y: Array
    scale: Array
    used: NDArray[np.intp]

    def with_shared(self, columns: Array, first: int) -> JointColumns:
        """Appends columns (M, k) of parameters that joints share, after those of the rigid body.

        Args:
            columns: not scaled.
            first: number of the first of their parameters.
        """
        scale = np.maximum(np.sqrt(np.mean(columns**2, axis=0)), np.finfo(float).tiny)
        return JointColumns(
            np.hstack([self.Y[:, :-OWN], columns / scale, self.Y[:, -OWN:]]),
            np.concatenate([self.scale[:-OWN], scale, self.scale[-OWN:]]),
            np.concatenate([self.used, first + np.arange(len(scale))]),
        )


def under_gravity(
    robot: Robot, q: Array, bodies: tuple[Array, ...], used: tuple[Places, ...], gravity: Array
) -> tuple[tuple[Array, ...], tuple[Places, ...]]:
    """Gives the columns of the rigid body, and the parameters that they belong to, under another gravity."""
    heavy = gravity_rows(robot, q)
    change = np.asarray(gravity, dtype=float) - np.asarray(robot.chain.gravity)
    found, places = [], []
    for body, columns, own in zip(bodies, used, heavy, strict=True):
        whole = np.einsum("mkp,k->mp", own, change)
        whole[:, columns] += body
        acts = np.flatnonzero(np.abs(whole).max(axis=0) > SILENT * max(float(np.abs(whole).max()), SILENT))
        found.append(whole[:, acts])
        places.append(acts.astype(np.intp))
    return tuple(found), tuple(places)


def joined(body: Array, used: NDArray[np.intp], dq: Array, ddq: Array, speed: float) -> JointColumns:
    """Appends rotor inertia, Coulomb and viscous friction and offset to the rigid body's columns (M, k)."""
    Y = np.empty((len(body), body.shape[1] + OWN))
    Y[:, :-OWN] = body
    sign = np.tanh(dq / max(SHARP * speed, 1e-12))
    for column, values in enumerate((ddq, sign, dq, 1.0), start=body.shape[1]):
        Y[:, column] = values
    scale = np.sqrt(np.einsum("ik,ik->k", Y, Y) / len(Y))
    # Rounding scaled to unit size would be a random regressor.
    silent = scale <= SILENT * scale.max()
    Y[:, silent], scale[silent] = 0.0, 1.0
    Y /= scale
    return JointColumns(Y, scale, used)
