"""A compliant base that tilts under the moment of the robot's weight."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from robots.robot import Robot
from robots.terms.effects import Coefficient, Effect, Situation
from robots.terms.effects.base_tilt import level_axes, tilted_torque, upright

Array = NDArray[np.float64]


class BaseCompliance(Effect):
    """tau = (d rigid/dg) (g x t), t = C m + R(q1) o: the base rotates about its horizontal axes by C per weight moment.

    m_k = e_k' (S x g) is the moment about the horizontal axis e_k, S the first moment of the links' masses about the
    base, and C is symmetric. On a level robot with a vertical first axis, no log shows the first link's first moments.
    They tilt the base by an unknown o that rotates with the first joint. Accelerations are neglected, so oscillations
    of the base are not included.
    """

    name: ClassVar[str] = "pattern:leaning:0:even"
    title: ClassVar[str] = "base compliance"
    whole_robot: ClassVar[bool] = True

    def parameters(self, robot: Robot, joint: int | None) -> tuple[Coefficient, ...]:
        """Describes the compliances about both horizontal axes, their coupling, and the first link's tilt."""
        compliances = tuple(Coefficient(f"compliance_{axes}", "rad/(N m)") for axes in ("1", "2", "12"))
        own = tuple(Coefficient(f"own_{axis}", "rad") for axis in ("1", "2"))
        return (*compliances, *own) if upright(robot) else compliances

    def joints(self, robot: Robot) -> tuple[int | None, ...]:
        """Returns the whole robot if gravity acts on it, else nothing."""
        return (None,) if np.any(robot.chain.gravity) else ()

    def columns(self, situation: Situation, joint: int | None, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque of all joints per compliance (N, n, 3), or per compliance and own angle (N, n, 5)."""
        robot, gravity = situation.robot, situation.gravity
        axes = level_axes(np.asarray(robot.chain.gravity, dtype=float))
        moment = np.cross(situation.sensitivity("moment").reshape(len(situation), 3), gravity) @ axes.T  # (N, 2)
        none = np.zeros(len(situation))
        leans = [(moment[:, 0], none), (none, moment[:, 1]), (moment[:, 1], moment[:, 0])]
        if upright(robot):
            first = robot.chain.joints[0]
            across = axes @ np.cross(first.rotation @ first.axis, axes).T  # e_i' (d x e_k)
            for k in range(2):
                angles = np.cos(situation.q[:, 0])[:, None] * np.eye(2)[k] + np.outer(
                    np.sin(situation.q[:, 0]), across[:, k]
                )
                leans.append((angles[:, 0], angles[:, 1]))
        return np.asarray(tilted_torque(situation) @ np.stack([np.column_stack(lean) for lean in leans], axis=2))

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
        if coefficients[int(np.argmax(np.abs(coefficients[:2])))] < 0:
            return (
                "The residual torque of all joints changes with the moment of the robot's weight about its base. The "
                "sign is opposite to that of a compliant base."
            )
        return (
            "The residual torque of all joints matches a compliant base that tilts under the robot's weight: by "
            f"up to {np.degrees(np.abs(coefficients[:3]).max()) * 1e3:.2g} deg per 1000 N m of weight moment."
        )
