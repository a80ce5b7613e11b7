"""Joint torque within its limit, by a torque model whose parameters are known to a margin."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi
import numpy as np
from numpy.typing import ArrayLike

from oed.constraints.pointwise import PointwiseLimit
from robots.batch import batch_function
from robots.common.arrays import Array
from robots.common.errors import InfeasibleError, InputError
from robots.plants import PlantEffect
from robots.regressor import TorqueModel


class TorqueLimit(PointwiseLimit):
    """|tau_j(q, dq, ddq)| <= (1 - margin) limit_j on every joint that has a limit.

    Args:
        model: the torque model, smooth in velocity (a Coulomb column of tanh).
        parameters: (p,), all finite.
        limit: (n,) [N m or N], infinite where there is none.
        margin: share of the limit kept for what the parameters are wrong by, 0 to below 1.
        effects: what the robot has beyond the model: effects of position, velocity and acceleration.

    Raises:
        InputError: parameters that are not finite, no joint with a limit, or a margin out of range.
        InfeasibleError: a limit of zero.
    """

    name = "torque"

    def __init__(
        self,
        model: TorqueModel,
        parameters: ArrayLike,
        limit: ArrayLike,
        *,
        margin: float = 0.1,
        effects: Sequence[PlantEffect] = (),
    ) -> None:
        pi, bound = np.asarray(parameters, dtype=float), np.asarray(limit, dtype=float)
        if not 0 <= margin < 1:
            raise InputError(f"a torque margin of {margin}", allowed="0 to below 1")
        if pi.shape != (model.size,) or not np.isfinite(pi).all():
            raise InputError("the torque limit needs all nominal parameters", remedy="describe the robot's dynamics")
        if (bound <= 0).any():
            joint = int(np.argmax(bound <= 0)) + 1
            raise InfeasibleError("its torque limit is zero, so it cannot hold its own weight", joint=joint)
        limited = np.flatnonzero(np.isfinite(bound))
        if not limited.size:
            raise InputError("no joint has a torque limit")
        self.model, self.parameters, self.margin, self._bound = model, pi, margin, bound
        self.effects = tuple(effects)
        self.joints = tuple(int(j) + 1 for j in limited)
        self.labels = tuple(f"torque of joint {joint}" for joint in self.joints)
        self.lower, self.upper = -np.ones(len(limited)), np.ones(len(limited))
        symbolic = model.symbolic()
        symbols = [casadi.SX.sym(name, model.robot.n) for name in ("q", "dq", "ddq")]
        total = symbolic(*symbols) @ casadi.SX(pi)
        gear_load = casadi.SX.zeros(model.robot.n)
        for effect in self.effects:
            if effect.term.loads_gear:
                gear_load += effect.expression(model, pi, *symbols)
        for effect in self.effects:
            if not effect.term.loads_gear:
                total += effect.expression(model, pi, *symbols, gear_load=gear_load)
        total += gear_load
        torque = total[limited.tolist()] / casadi.SX((1 - margin) * bound[limited])
        torque = casadi.densify(torque)
        slope = casadi.densify(casadi.jacobian(torque, casadi.vertcat(*symbols)))
        self._values = batch_function(casadi.Function("torque", symbols, [torque]))
        self._jacobian = batch_function(casadi.Function("slope", symbols, [slope]))

    def __reduce__(self) -> tuple[Any, ...]:
        # Compiled code does not cross process borders; it is found again in the cache.
        return _rebuild, (self.model, self.parameters, self._bound, self.margin, self.effects)

    def values(self, q: Array, dq: Array, ddq: Array) -> Array:
        """Gives torque over the usable limit (M, R)."""
        return self._values(q, dq, ddq)[0][:, :, 0]

    def jacobian(self, q: Array, dq: Array, ddq: Array) -> Array:
        """Gives its derivatives (M, R, 3 n)."""
        return self._jacobian(q, dq, ddq)[0]

    def check_holding(self, pose: ArrayLike) -> None:
        """Checks that the joints can hold a pose (n,) at all.

        Raises:
            InfeasibleError: naming the joint, its holding torque, and the limit that would do.
        """
        q = np.atleast_2d(np.asarray(pose, dtype=float))
        still = np.zeros_like(q)
        shares = np.abs(self.values(q, still, still)[0])
        refuse_holding(shares, self.joints, self._bound, self.margin, "usable torque limit", "torque limit")


def refuse_holding(
    shares: Array, joints: Sequence[int], limit: Array, margin: float, usable_name: str, name: str
) -> None:
    """Refuses a pose whose holding torque is above what a joint may use.

    Args:
        shares: holding torque over the usable limit (R,), zero or more.
        joints: R joints, counted from 1.
        limit: of all joints (n,) [N m or N].
        margin: share of the limit that is kept in reserve.
        usable_name: what is passed, in words.
        name: what would have to be larger, in words.

    Raises:
        InfeasibleError: naming the joint, its holding torque, and the limit that would do.
    """
    worst = int(np.argmax(shares))
    if shares[worst] > 1:
        joint = joints[worst]
        usable = (1 - margin) * float(limit[joint - 1])
        need = float(shares[worst]) * usable
        raise InfeasibleError(
            f"holding the pose takes {need:.3g} N m (prismatic: N); the {usable_name} is {usable:.3g} "
            f"({float(limit[joint - 1]):.3g} minus {100 * margin:g} % reserve)",
            joint=joint,
            allowed=f"a {name} of {need / (1 - margin):.3g} or more, another home pose or a smaller reserve",
        )


def _rebuild(
    model: TorqueModel, parameters: Array, limit: Array, margin: float, effects: tuple[PlantEffect, ...]
) -> TorqueLimit:
    return TorqueLimit(model, parameters, limit, margin=margin, effects=effects)
