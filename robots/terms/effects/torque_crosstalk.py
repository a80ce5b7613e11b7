"""A torque signal that contains part of the neighbouring joints' torque."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from robots.common.arrays import Array
from robots.terms.base import force_unit
from robots.terms.effect_bases.base import Coefficient, JointEffect, Place, Situation

if TYPE_CHECKING:
    from robots.robot import Robot


class TorqueCrosstalk(JointEffect):
    """tau_j = c tau_{j-1} + d tau_{j+1}: a sensor that also measures part of its neighbours' torque."""

    name: ClassVar[str] = "torque_crosstalk"
    title: ClassVar[str] = "crosstalk between torque signals"
    rare: ClassVar[bool] = True
    rivals: ClassVar[tuple[str, ...]] = ("joint_coupling", "torque_constant_error", "base_tilt")
    experiments: ClassVar[tuple[str, ...]] = ("single_joint", "payload")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the fractions of the neighbours' torque."""
        assert joint is not None
        return tuple(Coefficient(f"share_of_joint_{k}", "1", -0.5, 0.5) for k in _neighbours(robot, joint))

    def joints(self, robot: Robot) -> tuple[Place, ...]:
        """Lists all joints, if there are several."""
        return tuple(range(1, robot.n + 1)) if robot.n > 1 else ()

    def local(self, situation: Situation, joint: int, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the neighbours' torque (N, k)."""
        return situation.torque[:, [k - 1 for k in _neighbours(situation.robot, joint)]]

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
        shares = " and ".join(f"{100 * c:.3g} %" for c in coefficients)
        return f"The torque signal of joint {joint} contains {shares} of the torque of its neighbours."

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Returns the torque of the first neighbour."""
        assert joint is not None
        neighbour = _neighbours(situation.robot, joint)[0]
        unit = force_unit(situation.robot, neighbour - 1)
        return f"torque of joint {neighbour} [{unit}]", situation.torque[:, neighbour - 1]


def _neighbours(robot: Robot, joint: int) -> tuple[int, ...]:
    return tuple(k for k in (joint - 1, joint + 1) if 1 <= k <= robot.n)
