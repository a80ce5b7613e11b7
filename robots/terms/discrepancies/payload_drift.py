"""A payload that changes slowly with time: a tank that empties, a coil of wire that unwinds."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from robots.common.arrays import Array
from robots.robot import Robot
from robots.terms.discrepancies.gain_drift import OverTime, half_waves, log_time
from robots.terms.effects import Coefficient, Situation

PAYLOAD_WAVES = 3
_PARTS = (("mass", "kg"), ("moment_x", "kg m"), ("moment_y", "kg m"), ("moment_z", "kg m"))


class PayloadDrift(OverTime):
    """tau = Y_tool (m, m c) g(t), g a smooth function of time: k half cosine waves over the logs, k = 1 ... KNOTS.

    A payload that changes at one time is `payload_change`.
    """

    name: ClassVar[str] = "pattern:draining:0:even"
    title: ClassVar[str] = "slowly changing payload"

    def parameters(self, robot: Robot, joint: int | None) -> tuple[Coefficient, ...]:
        """Describes mass and first moments for each half wave."""
        return tuple(Coefficient(f"{part}_{k}", unit) for k in range(1, PAYLOAD_WAVES + 1) for part, unit in _PARTS)

    def columns(self, situation: Situation, joint: int | None, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque per inertial parameter, times each half wave (N, n, 4 KNOTS)."""
        body = situation.sensitivity("tool")[:, :, : len(_PARTS)]
        times = half_waves(log_time(situation), PAYLOAD_WAVES)
        return np.concatenate([body * wave[:, None, None] for wave in times.T], axis=2)

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
        mass = half_waves(np.linspace(0.0, 1.0, 201), PAYLOAD_WAVES) @ coefficients[:: len(_PARTS)]
        return (
            f"The residual torque of all joints matches a payload that changes slowly with time, such as a tank that "
            f"empties: by {float(np.ptp(mass)):.2g} kg over the logs."
        )
