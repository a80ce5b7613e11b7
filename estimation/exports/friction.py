"""An identified friction curve as Coulomb and viscous friction, which is all that simulators' files state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from estimation.models.model import Model
from robots.common.arrays import Array

# A larger difference from the identified curve, as a share of the largest friction or spring torque, is named.
NAMED_DIFFERENCE = 0.02


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearFriction:
    """``coulomb sign(dq) + viscous dq``, nearest to a model's friction.

    Attributes:
        coulomb: (n,) [N m or N], zero or more.
        viscous: (n,) [N m s/rad or N s/m], zero or more.
        fastest: (n,) speed up to which it was compared [rad/s or m/s].
        error: (n,) largest difference up to that speed [N m or N].
        largest: (n,) largest friction of the model up to that speed [N m or N].
    """

    coulomb: Array
    viscous: Array
    fastest: Array
    error: Array
    largest: Array


def linear_friction(model: Model) -> LinearFriction | None:
    """Fits Coulomb and viscous friction to the friction of a model by least squares.

    Args:
        model: an identified model. The curve is compared up to the recorded speeds; without them up to the velocity
            limits, or 1 rad/s.

    Returns:
        The friction; None if the model has no friction parameters.
    """
    torque_model, n = model.torque_model, model.robot.n
    friction = np.array([column.friction for column in model.parameters])
    if not friction.any():
        return None
    recorded = model.provenance.get("recorded")
    limits = np.where(np.isfinite(model.robot.limits.velocity), model.robot.limits.velocity, 1.0)
    fastest = np.asarray(limits if recorded is None else recorded["velocity"][0], dtype=float)
    fastest = np.where(fastest > 0.0, fastest, 1.0)
    # Below 2 % of the fastest speed the sign function of the model is smooth.
    count = 50
    shares = np.linspace(0.02, 1.0, count)
    speeds = shares[:, None] * fastest
    still = np.zeros((count, n))
    values = np.where(friction, model.values, 0.0)
    # Friction that differs by direction cannot be stated: its mean counts.
    forward, backward = (torque_model.torque(still, v, still, values, columns=model.columns) for v in (speeds, -speeds))
    curve = (forward - backward) / 2.0
    found = np.array([nnls(np.column_stack([np.ones(count), speeds[:, j]]), curve[:, j])[0] for j in range(n)])
    return LinearFriction(
        coulomb=found[:, 0],
        viscous=found[:, 1],
        fastest=fastest,
        error=np.abs(found[:, 0] + speeds * found[:, 1] - curve).max(axis=0),
        largest=np.abs(curve).max(axis=0),
    )
