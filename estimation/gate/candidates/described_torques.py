"""Torques of a log as multiples of those of the robot's description."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.gate.quick_fits.gravity_rows import gravity_rows
from estimation.gate.quick_fits.joint_fit import OWN
from estimation.gate.stages.fitted import Fitted

Array = NDArray[np.float64]

# Share of the described torque that must remain without friction and offset: less is not compared.
REMAINS = 0.02
# A torque has another size if its factor is known to this share, and beyond this one.
SURE, FAR = 0.2, 2.5


@dataclass(frozen=True)
class Multiple:
    """A factor on a described torque.

    Attributes:
        value: measured over described.
        error: standard error under correlated residuals; infinite if the described torque is too small.
    """

    value: float
    error: float


@dataclass(frozen=True, eq=False)
class DescribedTorque:
    """The torque of one joint by its description.

    Attributes:
        joint: counted from 0.
        whole: factor on the whole rigid-body torque.
        inertial: factor on the torque of accelerations and velocities, beside the next.
        gravity: factor on the torque of gravity.
        shape: correlation of the fitted rigid-body torque with the described one, both without friction and offset.
        size: standard deviation of the measured torque over that of the described one.
        friction: standard deviation of the fitted friction over that of the measured torque.
    """

    joint: int
    whole: Multiple
    inertial: Multiple
    gravity: Multiple
    shape: float
    size: float
    friction: float


def described_torques(fitted: Fitted) -> list[DescribedTorque]:
    """Compares the torque of each joint with that of the described links and rotors.

    Friction and offset are free, and so is the rotor's inertia where the description states none.

    Args:
        fitted: of a robot with described links.
    """
    robot, rows = fitted.robot, fitted.rows
    described = np.asarray(robot.inertia, dtype=float).ravel()
    heavy = gravity_rows(robot, rows.q) @ described @ np.asarray(robot.chain.gravity)
    found = []
    for joint, fit in enumerate(fitted.fits):
        if fit is None:
            continue
        rigid = fit.Y[:, :-OWN] @ (fit.scale[:-OWN] * described[fit.used])
        rotor = float(robot.rotor_inertia[joint])
        still = rigid - heavy[joint] + rotor * rows.ddq[:, joint]
        own = fit.Y[:, -OWN + 1 :] if rotor else fit.Y[:, -OWN:]
        tau = fit.Y @ fit.values + fit.residual
        fitted_rigid = fit.Y[:, :-OWN] @ fit.values[:-OWN]
        fitted_rigid = fitted_rigid + (fit.Y[:, -OWN] * fit.values[-OWN] if rotor else 0.0)
        both = np.column_stack([still + heavy[joint], still, heavy[joint], tau, fitted_rigid])
        rest = both - own @ np.linalg.lstsq(own, both, rcond=None)[0]
        least = REMAINS * (both[:, 0].std() + 1e-12)
        whole = _multiples(rest[:, :1], rest[:, 3], rows.block, least)[0]
        inertial, gravity = _multiples(rest[:, 1:3], rest[:, 3], rows.block, least)
        size = float(np.sqrt((rest[:, 0] @ rest[:, 0]) * (rest[:, 4] @ rest[:, 4])))
        friction = fit.Y[:, -OWN + 1 : -1] @ fit.values[-OWN + 1 : -1]
        found.append(
            DescribedTorque(
                joint=joint,
                whole=whole,
                inertial=inertial,
                gravity=gravity,
                shape=float(rest[:, 0] @ rest[:, 4]) / size if size > 0 else 0.0,
                size=float(tau.std() / max(float(both[:, 0].std()), 1e-12)),
                friction=float(friction.std() / max(float(tau.std()), 1e-300)),
            )
        )
    return found


def pooled(multiples: list[Multiple], own: float) -> Multiple:
    """Gives the mean of factors, each with its standard error and a share by which descriptions err.

    Args:
        multiples: of the joints.
        own: relative error of a description.
    """
    known = [one for one in multiples if np.isfinite(one.error)]
    if not known:
        return Multiple(np.nan, np.inf)
    weights = np.array([1.0 / (one.error**2 + own**2) for one in known])
    return Multiple(float(weights @ [one.value for one in known] / weights.sum()), float(weights.sum() ** -0.5))


def scales(torques: list[DescribedTorque], n: int) -> Array:
    """Gives the factors (n,) that bring torques to the described size, 1 of joints that are near it or not known."""
    factors = np.ones(n)
    for torque in torques:
        value = torque.whole.value
        if torque.whole.error < SURE * abs(value) and value > 0 and abs(np.log(value)) > np.log(FAR):
            factors[torque.joint] = 1.0 / value
    return factors


def _multiples(columns: Array, tau: Array, block: NDArray[np.intp], least: float) -> list[Multiple]:
    """Fits columns (M, k) to a torque (M,); a column that is small without the others has an infinite error."""
    alone = [float(np.std(_without(columns[:, i], np.delete(columns, i, axis=1)))) for i in range(columns.shape[1])]
    used = np.flatnonzero(np.array(alone) > least)
    found = [Multiple(np.nan, np.inf)] * columns.shape[1]
    # A column that cannot be told from the others stays in the fit as one of them, if it is not zero.
    kept = np.flatnonzero(np.abs(columns).max(axis=0) > 0)
    if not len(used):
        return found
    x = columns[:, kept]
    scale = np.sqrt(np.einsum("ik,ik->k", x, x))
    inverse = np.linalg.inv((x / scale).T @ (x / scale) + 1e-9 * np.eye(len(kept))) / scale[:, None] / scale
    values = inverse @ (x.T @ tau)
    starts = np.flatnonzero(np.diff(block, prepend=-1))
    scores = np.add.reduceat(x * (tau - x @ values)[:, None], starts, axis=0)
    covariance = inverse @ (scores.T @ scores) @ inverse
    for i in used:
        place = int(np.searchsorted(kept, i))
        found[i] = Multiple(float(values[place]), float(np.sqrt(covariance[place, place])))
    return found


def _without(column: Array, others: Array) -> Array:
    """Gives what other columns (M, k) do not explain of a column (M,)."""
    others = others[:, np.abs(others).max(axis=0) > 0] if others.size else others
    return column - others @ np.linalg.lstsq(others, column, rcond=None)[0] if others.size else column
