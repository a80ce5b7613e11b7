"""A torque signal of one joint that is logged late."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar

from robots.common.arrays import Array
from robots.terms.base import force_unit
from robots.terms.effect_bases.base import Coefficient, JointEffect, Place, Shape, Situation
from robots.terms.effects.time_delay import DELAY_ERROR, LEAST_DELAY, LEAST_SHIFT, SHIFT, Late, lateness, near

if TYPE_CHECKING:
    from robots.robot import Robot


class CurrentLag(Late, JointEffect):
    """tau_j(t - d) - tau_j(t): a delay of one joint's torque, for example by a current filter."""

    name: ClassVar[str] = "current_lag"
    title: ClassVar[str] = "delayed (filtered) torque signal of one joint"
    rare: ClassVar[bool] = True
    shapes: ClassVar[tuple[Shape, ...]] = (replace(SHIFT, lower=0.0, grid=tuple(s for s in SHIFT.grid if s > 0)),)
    rivals: ClassVar[tuple[str, ...]] = ("time_delay", "presliding_hysteresis", "joint_elasticity")
    experiments: ClassVar[tuple[str, ...]] = ("multisine", "micro_reversals")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the lag; a filter's lag is positive, and no drive has more than 50 ms."""
        return (Coefficient("lag", "s", 0.0, 0.05, DELAY_ERROR, LEAST_DELAY),)

    def ranges(self, robot: Robot, joint: Place, shape: tuple[float, ...]) -> tuple[tuple[float, float], ...]:
        """Bounds the lag to positive values near that of the reversals."""
        ((low, high),) = near(shape[0])
        return ((max(low, 0.0), max(high, LEAST_SHIFT)),)

    def local(self, situation: Situation, joint: int, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the change of the joint's torque per delay (N, 1) [N m/s]."""
        return lateness(situation, shape[0])[:, joint - 1 : joint]

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
        late = 1000 * coefficients[0]
        return f"The torque of joint {joint} is logged {late:.3g} ms late. Likely cause: a filter in its drive."

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Returns the rate of the joint's torque."""
        assert joint is not None
        unit = force_unit(situation.robot, joint - 1)
        return f"rate of the torque of joint {joint} [{unit}/s]", -lateness(situation, shape[0])[:, joint - 1]
