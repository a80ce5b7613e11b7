"""An elastic force on the flange that depends on its position: a hose, a cable or a balancer."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from robots.common.arrays import Array
from robots.robot import Robot
from robots.terms.effects import Coefficient, Effect, Situation

_WAYS = ("x", "y", "z")


class FlangeSpring(Effect):
    """tau = -J(q)' f(p), f = f0 + S p a force on the flange that is linear in the flange's position p.

    A constant downward force is a payload, which the base model contains.
    """

    name: ClassVar[str] = "pattern:pulling:0:even"
    title: ClassVar[str] = "elastic force on the flange (hose or cable)"
    whole_robot: ClassVar[bool] = True

    def parameters(self, robot: Robot, joint: int | None) -> tuple[Coefficient, ...]:
        """Describes the constant force f0, and the stiffnesses S per coordinate of the flange."""
        steady = (Coefficient(f"force_{way}", "N") for way in _WAYS)
        return (*steady, *(Coefficient(f"stiffness_{way}{by}", "N/m") for by in _WAYS for way in _WAYS))

    def columns(self, situation: Situation, joint: int | None, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque of unit forces, constant and times each coordinate of the flange (N, n, 12)."""
        arms = -np.swapaxes(situation.sensitivity("jacobian")[:, :3], 1, 2)  # (N, n, 3)
        place = situation.sensitivity("flange").reshape(len(situation), 3)
        return np.concatenate([arms, *(arms * place[:, k, None, None] for k in range(3))], axis=2)

    def describe(
        self,
        joint: int | None,
        coefficients: Array,
        shape: tuple[float, ...] = (),
        *,
        force: str = "N m",
        length: str = "rad",
    ) -> str:
        """Describes the finding in one sentence."""
        return (
            f"The residual torque of all joints matches an elastic force on the flange that depends on its position, "
            f"such as a hose or cable: up to {np.abs(coefficients[3:]).max():.2g} N/m."
        )
