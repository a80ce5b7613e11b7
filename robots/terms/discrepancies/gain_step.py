"""Torque of one joint that is logged by another share from one moment on: another amplifier, sensor or range."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from robots.robot import Robot
from robots.terms.effect_bases.sudden import Sudden
from robots.terms.effects import Coefficient, JointEffect, Situation

Array = NDArray[np.float64]

# Larger changes are no amplifier's or sensor's: another drive, or none.
MOST = 0.5


class GainStep(Sudden, JointEffect):
    """tau = e tau_j from the time t_c on.

    What heat makes of a motor's constant comes little by little, and is `torque_constant_heat`.
    """

    name: ClassVar[str] = "pattern:switch:0:even"
    title: ClassVar[str] = "a step in the torque gain of a joint"

    def parameters(self, robot: Robot, joint: int | None) -> tuple[Coefficient, ...]:
        """Describes the share by which the torque changes."""
        return (Coefficient("share", "1", -MOST, MOST),)

    def local(self, situation: Situation, joint: int, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the base model's torque after the change."""
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
        """Says what is seen."""
        change = f"{100 * abs(coefficients[0]):.2g} % {'more' if coefficients[0] > 0 else 'less'}"
        return (
            f"The residual torque of joint {joint} resembles a step of its gain: the torque is logged {change} from "
            f"t = {shape[0]:.2f} s on. A changed amplifier, sensor or sensor range is a typical cause."
        )
