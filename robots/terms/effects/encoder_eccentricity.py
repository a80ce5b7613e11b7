"""An encoder with an eccentric disc."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from robots.common.arrays import Array
from robots.terms.base import length_unit
from robots.terms.effect_bases.base import Coefficient, Effect, Place, Situation

if TYPE_CHECKING:
    from robots.robot import Robot


class EncoderEccentricity(Effect):
    """tau = (d rigid/dq_j) (a cos(q_j) + b sin(q_j)): the encoder value has an error with one period per turn."""

    name: ClassVar[str] = "encoder_eccentricity"
    title: ClassVar[str] = "encoder eccentricity"
    rare: ClassVar[bool] = True
    rivals: ClassVar[tuple[str, ...]] = ("encoder_offset", "spring", "torque_ripple")
    experiments: ClassVar[tuple[str, ...]] = ("payload", "static_hold")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the amplitudes of cosine and sine."""
        assert joint is not None
        length = length_unit(robot, joint - 1)
        return Coefficient("cosine", length, -0.1, 0.1), Coefficient("sine", length, -0.1, 0.1)

    def joints(self, robot: Robot) -> tuple[Place, ...]:
        """Lists the revolute joints."""
        return tuple(i for i, joint in enumerate(robot.chain.joints, start=1) if joint.kind == "revolute")

    def columns(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque of all joints per amplitude (N, n, 2)."""
        assert joint is not None
        q = situation.q[:, joint - 1, None, None]
        error = np.concatenate([np.cos(q), np.sin(q)], axis=2)
        return situation.sensitivity("position")[:, :, joint - 1 : joint] * error

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
        size = np.hypot(*coefficients)
        return f"The encoder of joint {joint} has an error with an amplitude of {size:.3g} {length}, once per turn."

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Returns the position."""
        assert joint is not None
        unit = length_unit(situation.robot, joint - 1)
        return f"position of joint {joint} [{unit}]", situation.q[:, joint - 1]
