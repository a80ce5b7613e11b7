"""Torques of a log as multiples of those of the robot's description."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.gate.quick_fits.gravity_rows import gravity_rows
from estimation.gate.quick_fits.joint_fit import OWN, JointFit
from estimation.gate.stages.fitted import Fitted

Array = NDArray[np.float64]

# Share of the described torque that must remain without friction and offset: less is not compared.
REMAINS = 0.02
# A torque has another size if its factor is known to this share, and beyond this one.
SURE, FAR = 0.2, 2.5
# Least correlation with the described torque, and its least share of the measured one above and below the described
# size.
SHAPED, LARGE, SMALL = 0.95, 0.5, 0.15
# Share of the fitted torque's power up to which it may be error of the fit.
NOISY = 0.3


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
        shape: correlation of the fitted rigid-body torque with the described one, both without friction and offset,
            corrected for the errors of the fit; NaN if these are too large.
        size: standard deviation of the measured torque over that of the described one.
        share: standard deviation of that multiple, without friction and offset, over that of the measured torque.
        friction: standard deviation of the fitted friction over that of the measured torque.
    """

    joint: int
    whole: Multiple
    inertial: Multiple
    gravity: Multiple
    shape: float
    share: float
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
        body = fit.Y[:, : -OWN + 1] if rotor else fit.Y[:, :-OWN]
        body = body - own @ np.linalg.lstsq(own, body, rcond=None)[0]
        both = np.column_stack([still + heavy[joint], still, heavy[joint], tau])
        rest = both - own @ np.linalg.lstsq(own, both, rcond=None)[0]
        least = REMAINS * (both[:, 0].std() + 1e-12)
        whole = _multiples(rest[:, :1], rest[:, 3], rows.block, least)[0]
        inertial, gravity = _multiples(rest[:, 1:3], rest[:, 3], rows.block, least)
        friction = fit.Y[:, -OWN + 1 : -1] @ fit.values[-OWN + 1 : -1]
        found.append(
            DescribedTorque(
                joint=joint,
                whole=whole,
                inertial=inertial,
                gravity=gravity,
                shape=_shape(fit, body, rest[:, 0]),
                share=float(abs(whole.value) * rest[:, 0].std() / max(float(tau.std()), 1e-300)),
                size=float(tau.std() / max(float(both[:, 0].std()), 1e-12)),
                friction=float(friction.std() / max(float(tau.std()), 1e-300)),
            )
        )
    return found


def _shape(fit: JointFit, body: Array, described: Array) -> float:
    """Correlates the fitted torque of some columns (M, k), the first of the fit, with a described one (M,)."""
    k, rows = body.shape[1], len(body)
    fitted = body @ fit.values[:k]
    covariance = (fit.inverse @ (fit.scores.T @ fit.scores) @ fit.inverse)[:k, :k]
    noise = float(np.sum(covariance * (body.T @ body))) / rows
    power = float(fitted @ fitted) / rows
    if not noise < NOISY * power:
        return np.nan
    size = np.sqrt((power - noise) * float(described @ described) / rows)
    return float(fitted @ described) / rows / float(size) if size > 0 else np.nan


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


def tells_size(torque: DescribedTorque) -> bool:
    """Whether a torque is a known multiple of the described one, and large enough beside friction.

    More than the described torque may also be an effect that looks like it.
    """
    value = torque.whole.value
    if not torque.whole.error < SURE * abs(value) or value <= 0 or torque.shape < SHAPED:
        return False
    return torque.share > (LARGE if value > 1 else SMALL)


def scales(torques: list[DescribedTorque], n: int) -> Array:
    """Gives the factors (n,) that bring torques to the described size, 1 of joints that are near it or not known."""
    factors = np.ones(n)
    for torque in torques:
        value = torque.whole.value
        if tells_size(torque) and abs(np.log(value)) > np.log(FAR):
            factors[torque.joint] = 1.0 / value
    return factors


def _multiples(columns: Array, tau: Array, block: NDArray[np.intp], least: float) -> list[Multiple]:
    """Fits columns (M, k) to a torque (M,); a column that is small without the others has an infinite error."""
    alone = [float(np.std(_without(columns[:, i], np.delete(columns, i, axis=1)))) for i in range(columns.shape[1])]
    used = np.flatnonzero(np.array(alone) > least)
    found = [Multiple(np.nan, np.inf)] * columns.shape[1]
    # A column that cannot be distinguished from the others stays in the fit as one of them, if it is not zero.
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
