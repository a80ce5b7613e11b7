"""A drifting zero of a torque sensor or current loop."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from robots.common.arrays import Array
from robots.terms.base import force_unit
from robots.terms.effect_bases.base import Coefficient, JointEffect, Place, Shape, Situation
from robots.terms.effect_bases.capabilities import Persistence

if TYPE_CHECKING:
    from robots.robot import Robot


class TorqueSensorDrift(JointEffect):
    """tau = sum_k b_k clip((t' - t_0 - k d) / d, 0, 1): the zero drifts by b_k during the k-th interval of length d.

    One interval as long as the data is a straight line; more intervals follow a varying drift. The zero is constant
    after the data's end, t' = min(t, t_1), because later drift is unknown. An interval with less than half of its
    length in the data is left out, because it is not determined.
    """

    name: ClassVar[str] = "torque_sensor_drift"
    title: ClassVar[str] = "zero drift of a torque sensor"
    persistence: ClassVar[Persistence] = Persistence.TRANSIENT
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("origin", "s", -np.inf, np.inf, "linear"),
        Shape("stretch", "s", 1e-3, 1e7, "log"),
        Shape("end", "s", -np.inf, np.inf, "linear", default=np.inf),
    )
    rivals: ClassVar[tuple[str, ...]] = ("payload_change", "thermal_friction", "torque_constant_heat", "spring")
    experiments: ClassVar[tuple[str, ...]] = ("repeat", "static_hold")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the drift in each interval."""
        assert joint is not None
        return tuple(Coefficient(f"drift_{k}", force_unit(robot, joint - 1)) for k in range(1, DRIFT_INTERVALS + 1))

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists a straight line, and drifts with more and more intervals."""
        (origin, _), (shortest, longest), (end, _) = self.bounds(situation, joint)
        pieces = [count for count in (1, 2, 4, 8, DRIFT_INTERVALS) if longest / count >= shortest]
        return tuple((origin, longest / count, end) for count in pieces)

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Fixes origin and end to those of the data, and bounds the intervals' length."""
        origin, end = float(situation.t[0]), float(situation.t[-1])
        duration = max(end - origin, 1.0)
        # Least length of an interval [s]; a faster change depends on the motion, not on time.
        return (origin, origin), (min(max(duration / DRIFT_INTERVALS, 3.5), duration), duration), (end, end)

    def local(self, situation: Situation, joint: int, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates one ramp per interval (N, 16); zero for intervals with less than half in the data."""
        origin, stretch, end = shape
        elapsed = (np.minimum(situation.t, end) - origin) / stretch
        begun = np.arange(DRIFT_INTERVALS)
        # Least fraction of an interval that lies in the data.
        shown = begun + 0.5 <= (end - origin) / stretch
        return np.asarray(np.clip(elapsed[:, None] - begun, 0.0, 1.0) * shown)

    def describe(
        self,
        joint: Place,
        coefficients: Array,
        shape: tuple[float, ...] = (),
        *,
        force: str = "N m",
        length: str = "rad",
    ) -> str:
        """Describes the values in one sentence."""
        places = np.concatenate([[0.0], np.cumsum(coefficients)])
        return f"The torque zero of joint {joint} drifts by {np.ptp(places):.3g} {force}."


DRIFT_INTERVALS = 16
"""Largest number of intervals."""
