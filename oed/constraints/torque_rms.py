"""The root mean square of a joint's torque over a motion, which is what heats its motor."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from oed.constraints.torque import TorqueLimit, refuse_holding
from robots.common.arrays import Array
from robots.plants import PlantEffect
from robots.regressor import TorqueModel


class TorqueRms:
    """sqrt(mean_k tau_j(q_k, dq_k, ddq_k)^2) <= (1 - margin) limit_j on every joint that has a limit.

    Args:
        model: the torque model.
        parameters: (p,), all finite.
        limit: (n,) [N m or N], infinite where there is none.
        margin: share of the limit kept for what the parameters are wrong by, 0 to below 1.
        effects: see `TorqueLimit`.

    Raises:
        InputError: as `TorqueLimit` does.
        InfeasibleError: a limit of zero.
    """

    name = "torque RMS"

    def __init__(
        self,
        model: TorqueModel,
        parameters: ArrayLike,
        limit: ArrayLike,
        *,
        margin: float = 0.1,
        effects: Sequence[PlantEffect] = (),
    ) -> None:
        self.torque = TorqueLimit(model, parameters, limit, margin=margin, effects=effects)
        self.effects = self.torque.effects
        self.model, self.parameters = self.torque.model, self.torque.parameters
        self.limit = np.asarray(limit, dtype=float)
        self.margin, self.joints = margin, self.torque.joints
        self.labels = tuple(f"torque RMS of joint {joint}" for joint in self.joints)

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuild, (self.model, self.parameters, self.limit, self.margin, self.effects)

    def values(self, q: Array, dq: Array, ddq: Array) -> Array:
        """Gives the root mean square over samples (M, n) as shares of the usable limits (R,)."""
        return np.sqrt(np.square(self.torque.values(q, dq, ddq)).mean(axis=0))

    def jacobian(self, q: Array, dq: Array, ddq: Array) -> Array:
        """Gives its derivatives by q, dq and ddq of every sample (R, M, 3 n)."""
        torque = self.torque.values(q, dq, ddq)
        rms = np.maximum(np.sqrt(np.square(torque).mean(axis=0)), np.finfo(float).tiny)
        weights = torque / rms / len(torque)  # (M, R)
        return np.asarray((weights[:, :, None] * self.torque.jacobian(q, dq, ddq)).transpose(1, 0, 2))

    def check_holding(self, pose: ArrayLike) -> None:
        """Checks that resting in a pose (n,) is not too much already.

        Raises:
            InfeasibleError: naming the joint, its holding torque, and the limit that would do.
        """
        q = np.atleast_2d(np.asarray(pose, dtype=float))
        shares = self.values(q, np.zeros_like(q), np.zeros_like(q))
        refuse_holding(shares, self.joints, self.limit, self.margin, "usable limit of RMS torque", "limit")


def _rebuild(
    model: TorqueModel, parameters: Array, limit: Array, margin: float, effects: tuple[PlantEffect, ...]
) -> TorqueRms:
    return TorqueRms(model, parameters, limit, margin=margin, effects=effects)
