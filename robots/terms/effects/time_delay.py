"""Torque and position that were not taken at the same instant."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from robots.terms.effects.base import Coefficient, Effect, Place, Shape, Situation

if TYPE_CHECKING:
    from robots.robot import Robot

Array = NDArray[np.float64]

SHIFT = Shape("reversals_late", "s", -0.02, 0.02, "linear", (-0.003, -0.001, -0.0002, 0.0002, 0.001, 0.003, 0.008))


class TimeDelay(Effect):
    """tau(t - d) - tau(t): the logged torque lags the logged position by d, on all joints alike.

    Of the smooth torque that is -d dtau/dt. Coulomb friction turns round within less than a sample, so that its
    difference is taken as it is, at the velocities of a moment d' before; d' = d where all is as it should be.
    """

    name: ClassVar[str] = "time_delay"
    title: ClassVar[str] = "torque that is logged later than position"
    whole_robot: ClassVar[bool] = True
    alike: ClassVar[bool] = True
    shapes: ClassVar[tuple[Shape, ...]] = (SHIFT,)
    rivals: ClassVar[tuple[str, ...]] = ("current_lag", "presliding_hysteresis", "joint_elasticity")
    experiments: ClassVar[tuple[str, ...]] = ("multisine", "micro_reversals")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the delay; more than 50 ms is no sensor's."""
        return (Coefficient("delay", "s", -0.05, 0.05),)

    def columns(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the change of torque per delay."""
        return lateness(situation, shape[0])[:, :, None]

    def likely(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[float | None, ...], ...]:
        """Gives the reversals that are as late as all else."""
        return as_late(coefficients)

    def describe(
        self,
        joint: Place,
        coefficients: Array,
        shape: tuple[float, ...] = (),
        *,
        force: str = "N m",
        length: str = "rad",
    ) -> str:
        """Says what the values mean."""
        which = "later" if coefficients[0] > 0 else "earlier"
        return f"Torque is logged {1000 * abs(coefficients[0]):.2f} ms {which} than position, on all joints."

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Gives the rate of torque of the joint where it is largest."""
        rate = -lateness(situation, shape[0])
        most = int(np.argmax(np.mean(rate**2, axis=0)))
        return f"rate of the torque of joint {most + 1} [N m/s]", rate[:, most]


def lateness(situation: Situation, shift: float) -> Array:
    """Gives the change of the base model's torque per delay (N, n) [N m/s], Coulomb friction turning `shift` [s] late.

    Of a robot that hardly turns round, this is -dtau/dt.
    """

    def evaluate() -> Array:
        smooth = situation.cached("rate", lambda: situation.derivatives(situation.torque - situation.friction)[0])
        step = shift if abs(shift) > 1e-7 else 1e-7
        before = situation.friction_at(situation.dq - step * situation.ddq)
        return (before - situation.friction) / step - smooth

    # Joints share the points of the grid; those of a search are as many as they are brief.
    return situation.cached(("lateness", shift), evaluate) if shift in SHIFT.grid else evaluate()


def as_late(coefficients: Array) -> tuple[tuple[float, ...], ...]:
    """Gives the shape that a delay (1,) [s] has where reversals are no exception."""
    return ((float(np.clip(coefficients[0], SHIFT.lower, SHIFT.upper)),),)
