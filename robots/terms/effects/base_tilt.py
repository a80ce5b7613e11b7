"""A base that does not stand level."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from robots.terms.base import force_unit
from robots.terms.effects.base import Coefficient, Effect, Place, Shape, Situation

if TYPE_CHECKING:
    from robots.robot import Robot

Array = NDArray[np.float64]


class BaseTilt(Effect):
    """tau = (d rigid/dg) (g x e1) a + (d rigid/dg) (g x e2) b: gravity turned by small angles about two level axes.

    The axes are level where the robot stands as described, and turn with the base where a log's base is tilted: the
    base is set askew on its mount. About an upright first axis a level robot has moments that no log of it shows, and
    its base parameters lack: where `own_moments` is 1, they pull by c cos(q1) + s sin(q1) on the first joint besides.
    """

    name: ClassVar[str] = "base_tilt"
    title: ClassVar[str] = "a base that is not level"
    whole_robot: ClassVar[bool] = True
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("own_moments", "", 0.0, 1.0, "linear", (0.0,), default=0.0),)
    rivals: ClassVar[tuple[str, ...]] = ("spring", "encoder_offset", "torque_constant_error", "payload_change")
    experiments: ClassVar[tuple[str, ...]] = ("static_hold", "second_base_pose")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the base's rotations about its two level axes (x and y where gravity is along z), and the rest."""
        tilts = Coefficient("tilt_1", "rad", -0.5, 0.5), Coefficient("tilt_2", "rad", -0.5, 0.5)
        unit = force_unit(robot, 0)
        own = Coefficient("moment_cosine", unit), Coefficient("moment_sine", unit)
        return (*tilts, *own) if upright(robot) else tilts

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Leaves the moments of an upright axis to `likely`."""
        return ((0.0, 0.0),)

    def likely(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[float | None, ...], ...]:
        """Gives the moments of an upright first axis, none and free; a log from another base has shown them."""
        level = np.asarray(situation.robot.chain.gravity, dtype=float)
        alike = upright(situation.robot) and bool(np.all(situation.gravity == level))
        return ((0.0,), (1.0,)) if alike else ((0.0,),)

    def complete(self, situation: Situation, joint: Place, shape: tuple[float, ...]) -> tuple[float, ...]:
        """Gives the first axis' own moments, if they may be there: angles would take what they are."""
        ((free,), *_) = reversed(self.likely(situation, joint, shape, np.zeros(0)))
        return shape if free is None else (free,)

    def joints(self, robot: Robot) -> tuple[Place, ...]:
        """Names the whole robot, if there is gravity."""
        return (None,) if np.any(robot.chain.gravity) else ()

    def leaves(self, robot: Robot, joint: int, shape: tuple[float, ...] = ()) -> float:
        """Gives half of it for an upright first axis whose own moments are too small to be told: they show."""
        hidden = joint == 0 and upright(robot) and not (shape and shape[0] > 0)
        return 0.5 if hidden else super().leaves(robot, joint, shape)

    def columns(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque of all joints per angle, and of the first joint per N m of its own moments."""
        tilted = tilted_torque(situation)
        if not upright(situation.robot):
            return tilted
        own = np.zeros_like(tilted)
        if shape and shape[0]:
            own[:, 0, 0], own[:, 0, 1] = np.cos(situation.q[:, 0]), np.sin(situation.q[:, 0])
        return np.concatenate([tilted, own], axis=2)

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
        angle = np.degrees(np.hypot(*coefficients[:2]))
        return f"The base is tilted by {angle:.3g} deg: gravity does not pull where the description says."


def upright(robot: Robot) -> bool:
    """Whether the first joint turns about gravity: moments of its link are then not shown by a level robot."""
    first, down = robot.chain.joints[0], np.asarray(robot.chain.gravity, dtype=float)
    along = float(abs(first.rotation @ first.axis @ down)) > 0.99 * float(np.linalg.norm(down))
    return first.kind == "revolute" and along


def tilted_torque(situation: Situation) -> Array:
    """Evaluates the torque of all joints per angle of the base about each of its level axes (N, n, 2)."""
    axes = level_axes(np.asarray(situation.robot.chain.gravity, dtype=float))
    turned = np.cross(situation.gravity[:, None], axes)  # (N, 2, 3)
    return np.asarray(situation.sensitivity("gravity") @ turned.transpose(0, 2, 1))


def level_axes(gravity: Array) -> Array:
    """Gives two unit axes (2, 3) across gravity (3,): x and y where it is along z."""
    down = gravity / np.linalg.norm(gravity)
    nearest = np.eye(3)[np.argsort(np.abs(down), kind="stable")[:2]]
    first = nearest[0] - (nearest[0] @ down) * down
    first /= np.linalg.norm(first)
    second = nearest[1] - (nearest[1] @ down) * down - (nearest[1] @ first) * first
    return np.stack([first, second / np.linalg.norm(second)])
