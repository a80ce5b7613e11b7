"""A base that is tilted against the robot's description."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from robots.common.arrays import Array
from robots.terms.effect_bases.base import Coefficient, Effect, Place, Shape, Situation
from robots.terms.effect_bases.capabilities import GearLoad

if TYPE_CHECKING:
    from robots.robot import Robot


# First moments [kg m] of all that rotates about a vertical first axis, along the horizontal axes at zero joint angle.
OWN = tuple(Shape(f"own_moment_{k}", "kg m", -np.inf, np.inf, "linear", (0.0,), default=0.0, beside=True) for k in "12")


class BaseTilt(Effect):
    """tau = (d rigid/dg) (g x e1) a + (d rigid/dg) (g x e2) b: gravity rotated by small angles about two axes.

    The axes are horizontal if the robot stands as described. They rotate with the base in logs of a base that was
    tilted by a known angle. On a level robot with a vertical first axis d, the first moments s about that axis cause no
    torque, so the base parameters do not contain them. With a tilt they add -d' (R(q1) s x (g x e_k)) to the torque of
    the first joint, per angle.
    """

    name: ClassVar[str] = "base_tilt"
    title: ClassVar[str] = "tilted base"
    gear_load: ClassVar[GearLoad] = GearLoad.CAUSES
    whole_robot: ClassVar[bool] = True
    shapes: ClassVar[tuple[Shape, ...]] = OWN
    rivals: ClassVar[tuple[str, ...]] = ("spring", "encoder_offset", "torque_constant_error", "payload_change")
    experiments: ClassVar[tuple[str, ...]] = ("static_hold", "second_base_pose")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the base's rotations about two horizontal axes (x and y if gravity is along z)."""
        return Coefficient("tilt_1", "rad", -0.5, 0.5), Coefficient("tilt_2", "rad", -0.5, 0.5)

    def unused(self, shape: tuple[float, ...]) -> frozenset[int]:
        """Returns both moments if both are zero."""
        return frozenset() if any(shape) else frozenset((0, 1))

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Bounds the moments of a vertical first axis; zero for other axes, and if logs include a tilted base."""
        most = _largest(situation)
        return ((-most, most), (-most, most))

    def joints(self, robot: Robot) -> tuple[Place, ...]:
        """Returns the whole robot if gravity acts on it, else nothing."""
        return (None,) if np.any(robot.chain.gravity) else ()

    def leakage(self, robot: Robot, joint: int, shape: tuple[float, ...] = ()) -> float:
        """Returns one half for a vertical first axis without fitted moments, else the default."""
        hidden = joint == 0 and upright(robot) and not any(shape)
        return 0.5 if hidden else super().leakage(robot, joint, shape)

    def complete(self, situation: Situation, joint: Place, shape: tuple[float, ...]) -> tuple[float, ...]:
        """Adds start values of the first axis' moments if they are possible; without them the angles are biased."""
        most = _largest(situation)
        # Start of the search for the own moments, as a fraction of their bound.
        near = 0.01
        return shape if any(shape) or not most else (near * most, near * most)

    def columns(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque of all joints per angle (N, n, 2)."""
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
    """Returns whether the first joint rotates about the direction of gravity.

    A level robot then does not show the first moments about that axis.
    """
    first, down = robot.chain.joints[0], np.asarray(robot.chain.gravity, dtype=float)
    along = float(abs(first.rotation @ first.axis @ down)) > 0.99 * float(np.linalg.norm(down))
    return first.kind == "revolute" and along


def _own_torque(situation: Situation, moments: tuple[float, ...]) -> Array:
    """Computes the torque of a vertical first joint per tilt angle (N, 2) from its first moments [kg m]."""
    first = situation.robot.chain.joints[0]
    axis = first.rotation @ first.axis
    axes = level_axes(np.asarray(situation.robot.chain.gravity, dtype=float))
    s, q = np.asarray(moments) @ axes, situation.q[:, :1]
    turned = np.cos(q) * s + np.sin(q) * np.cross(axis, s)  # (N, 3)
    pulls = np.cross(situation.gravity[:, None], axes)  # (N, 2, 3)
    return np.asarray(-np.cross(turned[:, None], pulls) @ axis)


def _largest(situation: Situation) -> float:
    """Computes the bound of a vertical first axis' first moments [kg m]; zero if logs determine them."""
    level = np.asarray(situation.robot.chain.gravity, dtype=float)
    if not upright(situation.robot) or not bool(np.all(situation.gravity == level)):
        return 0.0

    def shown() -> float:
        return float(np.linalg.norm(situation.sensitivity("gravity"), axis=2).max())

    return situation.cached("largest first moment", shown)


def tilted_torque(situation: Situation) -> Array:
    """Evaluates the torque of all joints per angle of the base about each horizontal axis (N, n, 2)."""
    axes = level_axes(np.asarray(situation.robot.chain.gravity, dtype=float))
    turned = np.cross(situation.gravity[:, None], axes)  # (N, 2, 3)
    return np.asarray(situation.sensitivity("gravity") @ turned.transpose(0, 2, 1))


def level_axes(gravity: Array) -> Array:
    """Returns two unit axes (2, 3) orthogonal to gravity (3,): x and y if it is along z."""
    down = gravity / np.linalg.norm(gravity)
    nearest = np.eye(3)[np.argsort(np.abs(down), kind="stable")[:2]]
    first = nearest[0] - (nearest[0] @ down) * down
    first /= np.linalg.norm(first)
    second = nearest[1] - (nearest[1] @ down) * down - (nearest[1] @ first) * first
    return np.stack([first, second / np.linalg.norm(second)])
