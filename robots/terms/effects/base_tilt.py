"""A base that does not stand level."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from robots.terms.effect_bases.base import Coefficient, Effect, Place, Shape, Situation

if TYPE_CHECKING:
    from robots.robot import Robot

Array = NDArray[np.float64]


# First moments [kg m] of what turns about an upright first axis, along the level axes where that joint is at zero.
OWN = tuple(Shape(f"own_moment_{k}", "kg m", -np.inf, np.inf, "linear", (0.0,), default=0.0, beside=True) for k in "12")
# They are no larger than this times the largest that the other joints show: theirs is the same arm.
LARGEST = 1.0
# Where a search for them begins, as a share of that.
NEAR = 0.01


class BaseTilt(Effect):
    """tau = (d rigid/dg) (g x e1) a + (d rigid/dg) (g x e2) b: gravity turned by small angles about two level axes.

    The axes are level where the robot stands as described, and turn with the base where a log's base is tilted: the
    base is set askew on its mount. About an upright first axis d a level robot has first moments s that no log of it
    shows, and its base parameters lack. A tilt shows them: -d' (R(q1) s x (g x e_k)) on the first joint besides. They
    act by the angles alone: without those, what pulls there is something else.
    """

    name: ClassVar[str] = "base_tilt"
    title: ClassVar[str] = "tilted base"
    loads_gear: ClassVar[bool] = True
    whole_robot: ClassVar[bool] = True
    shapes: ClassVar[tuple[Shape, ...]] = OWN
    rivals: ClassVar[tuple[str, ...]] = ("spring", "encoder_offset", "torque_constant_error", "payload_change")
    experiments: ClassVar[tuple[str, ...]] = ("static_hold", "second_base_pose")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the base's rotations about its two level axes (x and y where gravity is along z)."""
        return Coefficient("tilt_1", "rad", -0.5, 0.5), Coefficient("tilt_2", "rad", -0.5, 0.5)

    def unused(self, shape: tuple[float, ...]) -> frozenset[int]:
        """Gives the shape without moments."""
        return frozenset() if any(shape) else frozenset((0, 1))

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Gives what an upright first axis may have; a log from another base has shown it, and no other has any."""
        most = _largest(situation)
        return ((-most, most), (-most, most))

    def joints(self, robot: Robot) -> tuple[Place, ...]:
        """Names the whole robot, if there is gravity."""
        return (None,) if np.any(robot.chain.gravity) else ()

    def leakage(self, robot: Robot, joint: int, shape: tuple[float, ...] = ()) -> float:
        """Gives half of it for an upright first axis whose own moments are too small to be determined."""
        hidden = joint == 0 and upright(robot) and not any(shape)
        return 0.5 if hidden else super().leakage(robot, joint, shape)

    def complete(self, situation: Situation, joint: Place, shape: tuple[float, ...]) -> tuple[float, ...]:
        """Gives the first axis' own moments, if they may be there: angles would take what they are."""
        most = _largest(situation)
        return shape if any(shape) or not most else (NEAR * most, NEAR * most)

    def columns(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque of all joints per angle."""
        tilted = tilted_torque(situation)
        if any(shape):
            tilted = tilted.copy()
            tilted[:, 0] += _own_torque(situation, shape)
        return tilted

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
        angle = np.degrees(np.hypot(*coefficients[:2]))
        return f"The base is tilted by {angle:.3g} deg relative to the robot's description."


def upright(robot: Robot) -> bool:
    """Whether the first joint turns about gravity: moments of its link are then not shown by a level robot."""
    first, down = robot.chain.joints[0], np.asarray(robot.chain.gravity, dtype=float)
    along = float(abs(first.rotation @ first.axis @ down)) > 0.99 * float(np.linalg.norm(down))
    return first.kind == "revolute" and along


def _own_torque(situation: Situation, moments: tuple[float, ...]) -> Array:
    """Torque of an upright first joint per angle (N, 2), by its own first moments [kg m]."""
    first = situation.robot.chain.joints[0]
    axis = first.rotation @ first.axis
    axes = level_axes(np.asarray(situation.robot.chain.gravity, dtype=float))
    s, q = np.asarray(moments) @ axes, situation.q[:, :1]
    turned = np.cos(q) * s + np.sin(q) * np.cross(axis, s)  # (N, 3)
    pulls = np.cross(situation.gravity[:, None], axes)  # (N, 2, 3)
    return np.asarray(-np.cross(turned[:, None], pulls) @ axis)


def _largest(situation: Situation) -> float:
    """The largest first moment that an upright first axis may have [kg m], where no log of a tilted base shows it."""
    level = np.asarray(situation.robot.chain.gravity, dtype=float)
    if not upright(situation.robot) or not bool(np.all(situation.gravity == level)):
        return 0.0

    def shown() -> float:
        return float(np.linalg.norm(situation.sensitivity("gravity"), axis=2).max())

    return LARGEST * situation.cached("largest first moment", shown)


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
