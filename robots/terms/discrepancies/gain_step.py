"""A sudden gain change of one joint's torque signal: another amplifier, sensor or measuring range."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from robots.common.arrays import Array
from robots.common.plain import percent
from robots.robot import Robot
from robots.terms.effect_bases.sudden import Sudden
from robots.terms.effects import Coefficient, JointEffect, Situation


class GainStep(Sudden, JointEffect):
    """tau_e = e tau_j from the time t_c on.

    The temperature dependence of a torque constant is gradual; see `torque_constant_heat`.
    """

    name: ClassVar[str] = "pattern:switch:0:even"
    title: ClassVar[str] = "sudden gain change of a torque signal"

    def parameters(self, robot: Robot, joint: int | None) -> tuple[Coefficient, ...]:
        """Describes the relative change of the torque."""
        # Largest relative change; larger ones are not caused by an amplifier or sensor.
        most = 0.5
        return (Coefficient("share", "1", -most, most),)

    def local(self, situation: Situation, joint: int, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the base model's torque after the change, zero before (N, 1)."""
        return np.where(situation.t >= shape[0], situation.torque[:, joint - 1], 0.0)[:, None]

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
        change = f"{percent(abs(coefficients[0]))} {'more' if coefficients[0] > 0 else 'less'}"
        return (
            f"The residual torque of joint {joint} matches a torque signal logged {change} from t = {shape[0]:.2f} s "
            f"on than before. Likely cause: another amplifier, sensor or measuring range."
        )
