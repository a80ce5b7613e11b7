"""The band about a prediction, and what a motion has that the fit has not seen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimation.comparisons.common_parameters import friction_table
from estimation.models.model import Model
from estimation.uncertainty.quantiles import NORMAL_95
from robots.common.arrays import Array
from robots.common.plain import two_digits
from robots.common.stretches import chunks
from robots.signals import Motion
from robots.terms.base import length_unit

# Shares of the fitted speeds at which friction is slow, and holds a joint at rest.
SLOW = np.array([0.05, 0.1, 0.2])


def band_of_motion(
    model: Model, motion: Motion, gravity: Array | None, rest: NDArray[np.bool_] | None = None
) -> tuple[Array, NDArray[np.bool_]] | None:
    """Half-widths (N, n) of the 95 % band, and where (N, n) the motion is an extrapolation; None without a band.

    The width of the fitted logs' errors, that of the parameters' errors and that of friction beyond the fitted speeds
    add up as independent ones do. The latter two grow with the distance from what the fit has seen: speeds,
    accelerations and places that its rows hardly held. A joint at rest (N, n) may be held by friction up to that of
    slow motion, in either direction.
    """
    known = model.provenance
    if known.get("band95") is None:
        return None
    level = np.broadcast_to(np.asarray(known["band95"], dtype=float), motion.q.shape)
    # A diagnosis states no covariance: then only the friction beyond the fitted speeds grows.
    covariance, growth, reach = (
        np.asarray(known.get(key, 0.0), dtype=float) for key in ("band_covariance", "band_growth", "band_reach")
    )
    torque_model, (open_, shape, held) = model.torque_model.under(gravity), np.zeros((3, *motion.q.shape))
    friction = np.array([column.friction for column in model.parameters])
    holding = _slow_friction(model) if rest is not None and rest.any() else None
    for rows in chunks(len(motion)):
        Y = torque_model.regressor(motion.q[rows], motion.dq[rows], motion.ddq[rows], columns=model.columns)
        if covariance.ndim:
            open_[rows] = np.sqrt(np.maximum(np.einsum("tjp,tjp->tj", Y @ covariance, Y), 0.0))
        torque = Y[:, :, friction] @ model.values[friction]
        shape[rows] = _friction_beyond(model, torque, motion.dq[rows])
        if rest is not None and holding is not None:
            held[rows] = np.where(rest[rows], holding + np.abs(torque), 0.0)
    return np.hypot(level, NORMAL_95 * np.hypot(growth * open_, shape)) + held, open_ > reach


def _slow_friction(model: Model) -> Array:
    """Largest friction of each joint (n,) at speeds up to a fifth of the fitted ones [N m or N]."""
    recorded = model.provenance.get("recorded")
    if recorded is None:
        return np.zeros(model.robot.n)
    return np.asarray(np.abs(_friction_at(model, np.asarray(recorded["velocity"][0], dtype=float), SLOW)).max(axis=0))


def _friction_at(model: Model, speed: Array, shares: Array) -> Array:
    """Friction (m, n) at some shares (m,) of each joint's speed (n,)."""
    names = [column.name for column in model.parameters if column.friction]
    values = model.values[[column.friction for column in model.parameters]]
    table = friction_table(model, names, speed, shares)
    return np.array([[sum(row[i] * values[i] for i in own) for own in _columns_by_joint(model)] for row in table])


def _friction_beyond(model: Model, friction: Array, dq: Array) -> Array:
    """Standard deviation (N, n) of friction beyond the fitted speeds, zero within them.

    No log says how a friction curve goes on. It is the difference between two ways that the fitted speeds do not tell
    apart: the model's own, and a straight line with the mean slope of the upper half of these speeds.

    Args:
        model: the model.
        friction: by the model (N, n) [N m or N].
        dq: velocities (N, n) [rad/s or m/s].
    """
    recorded = model.provenance.get("recorded")
    if recorded is None:
        return np.zeros(dq.shape)
    fitted = np.asarray(recorded["velocity"][0], dtype=float)
    half, whole = _friction_at(model, fitted, np.array([0.5, 1.0]))
    slope = np.divide(2 * (whole - half), fitted, out=np.zeros_like(fitted), where=fitted > 0)
    further = np.abs(dq) - fitted
    return np.asarray(np.where(further > 0, np.abs(np.sign(dq) * friction - whole - slope * further), 0.0))


def _columns_by_joint(model: Model) -> list[list[int]]:
    """Places of each joint's columns among those of friction."""
    joints = [column.joint for column in model.parameters if column.friction]
    return [[i for i, own in enumerate(joints) if own == joint] for joint in range(1, model.robot.n + 1)]


def beyond_the_recorded(model: Model, motion: Motion) -> tuple[str, ...]:
    """Says of each joint by how much its speed, acceleration or range exceeds the recorded one."""
    recorded, found = model.provenance.get("recorded"), []
    if recorded is None:
        return ()
    lowest, highest = (np.asarray(bound, dtype=float) for bound in recorded["position"])
    # A speed, acceleration or range larger than the recorded one by this factor is reported.
    beyond = 1.1
    for joint, name in enumerate(model.robot.joint_names):
        texts = [
            f"{two_digits(ratio)} times the recorded {what}"
            for what, key, signal in (("speed", "velocity", motion.dq), ("acceleration", "acceleration", motion.ddq))
            if (ratio := _ratio(signal[:, joint], recorded[key][0][joint])) > beyond
        ]
        q = motion.q[:, joint]
        outside = max(float(lowest[joint] - q.min()), float(q.max() - highest[joint]))
        if outside > (beyond - 1) * float(highest[joint] - lowest[joint]):
            texts.append(f"{outside:.2g} {length_unit(model.robot, joint)} outside the recorded range")
        if texts:
            found.append(f"joint {joint + 1} ({name}): {', '.join(texts)}")
    return tuple(found)


def _ratio(signal: Array, recorded: float) -> float:
    largest = float(np.abs(signal).max())
    return largest / recorded if recorded > 0 else np.inf if largest > 0 else 1.0
