"""A delay between torque and position that changes with time, on all joints, as with two drifting clocks."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from robots.common.arrays import Array
from robots.robot import Robot
from robots.terms.discrepancies.gain_drift import OverTime, half_waves, log_time
from robots.terms.effects import Coefficient, Situation
from robots.terms.effects.time_delay import lateness

DELAY_WAVES = 3


class ClockDrift(OverTime):
    """tau_e,j = -g(t) dtau_j/dt on every joint j, g a smooth delay: k half cosine waves over the logs, k = 1 ... KNOTS.

    A constant delay is `time_delay`.
    """

    name: ClassVar[str] = "pattern:parting:0:even"
    title: ClassVar[str] = "drift between the clocks of torque and position"

    def parameters(self, robot: Robot, joint: int | None) -> tuple[Coefficient, ...]:
        """Describes the amplitude of each half wave."""
        return tuple(Coefficient(f"delay_{k}", "s") for k in range(1, DELAY_WAVES + 1))

    def columns(self, situation: Situation, joint: int | None, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the change of torque per delay, times each half wave (N, n, KNOTS)."""
        times = half_waves(log_time(situation), DELAY_WAVES)
        # Time [s] of the difference quotient for the change of torque per delay; friction changes sign within a sample.
        return np.asarray(lateness(situation, 1e-3)[:, :, None] * times[:, None])

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
        late = half_waves(np.linspace(0.0, 1.0, 201), DELAY_WAVES) @ coefficients
        return (
            "The delay between logged torque and position changes with time, on all joints: by about "
            f"{1000 * float(np.ptp(late)):.2g} ms over the logs. Likely cause: two clocks with different rates."
        )
