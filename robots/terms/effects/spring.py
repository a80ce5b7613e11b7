"""A spring on a joint, such as a balancer, a gas spring or a cable bundle."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import casadi
import numpy as np

from robots.common.arrays import Array
from robots.terms.base import force_unit, length_unit
from robots.terms.effect_bases.base import Coefficient, Place, Shape, Situation
from robots.terms.effect_bases.capabilities import GearLoad
from robots.terms.effect_bases.static import Instant, StaticJointEffect

if TYPE_CHECKING:
    from robots.robot import Robot


PLAIN = (0.0, 0.0, 3.0)
LINEAR = (0.0, 0.0, 1.0)

# Lever ratios and dead centres [rad] of the scan.
RATIOS, CENTRES = (0.35,), tuple(float(x) for x in np.arange(-np.pi, np.pi, np.pi / 4))
# Least length of the shorter lever, as a fraction of the other; below it the spring counts as one without levers.
SHORTEST_LEVER = 0.1
LEVER = Shape("lever_ratio", "", 0.0, 0.95, "linear", inexact=0.1, default=0.0)
CENTRE = Shape("dead_centre", "rad", -1.5 * np.pi, 1.5 * np.pi, "linear", inexact=0.1, default=0.0)
# Highest power of the deflection in the torque: a spring is linear unless the data require more.
POWER = Shape("highest_power", "", 1.0, 3.0, "linear", default=3.0, choices=(1.0, 3.0))


class Spring(StaticJointEffect):
    """tau = (p + c1 s + c2 s^2 + c3 s^3) ds/dq, s the deflection of the spring at joint position q.

    A cable or a torsion spring has s = q minus the middle of the joint's range. Its p is the base model's offset. A
    linear one has c2 = c3 = 0. A balancer is fixed to both links, at the distances r a and a from the joint. It has
    s = (L - 1) / r with the length L = sqrt(1 + r^2 - 2 r cos(q - q0)) over a. At the dead centre q0 its ends are
    nearest. Its c3 is zero, because two orders and the lever's nonlinearity fit a gas spring. The part of the torque
    proportional to sin(q) or cos(q) is the same as gravity on a level base, and becomes part of the base model.
    """

    name: ClassVar[str] = "spring"
    title: ClassVar[str] = "spring or cable on the joint"
    gear_load: ClassVar[GearLoad] = GearLoad.PRELOADS
    undetermined_text: ClassVar[str] = (
        "A spring or cable acts on joint {joint}. These logs do not determine its stiffness, because gravity has a "
        "similar effect."
    )
    shapes: ClassVar[tuple[Shape, ...]] = (LEVER, CENTRE, POWER)
    rivals: ClassVar[tuple[str, ...]] = ("base_tilt", "torque_ripple", "asymmetric_friction", "encoder_offset")
    experiments: ClassVar[tuple[str, ...]] = ("static_hold", "second_base_pose", "payload")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the stiffness, its next two orders, and the preload at s = 0."""
        assert joint is not None
        force, length = force_unit(robot, joint - 1), length_unit(robot, joint - 1)
        return (
            Coefficient("stiffness", f"{force}/{length}"),
            Coefficient("stiffness_2", f"{force}/{length}2"),
            Coefficient("stiffness_3", f"{force}/{length}3"),
            Coefficient("preload", force),
        )

    def described(self, robot: Robot, joint: Place, shape: tuple[float, ...]) -> tuple[Coefficient, ...]:
        """Describes the coefficients.

        The third order of a lever is unused, the preload of a plain spring, and the higher orders of a linear one.
        """
        stiffness, second, third, preload = self.parameters(robot, joint)
        none = Coefficient("", "")
        if _has_lever(shape):
            return stiffness, second, none, preload
        return (stiffness, second, third, none) if shape[2] > 1.0 else (stiffness, none, none, none)

    def unused(self, shape: tuple[float, ...]) -> frozenset[int]:
        """Returns ratio and dead centre of a spring without levers, and the power, which the coefficients show."""
        return frozenset((2,)) if _has_lever(shape) else frozenset((0, 1, 2))

    def is_plausible(self, robot: Robot, joint: Place, coefficients: Array, shape: tuple[float, ...] = ()) -> bool:
        """Rejects a spring whose ends nearly meet within the joint's limits, which resembles a local fault there."""
        assert joint is not None
        # Ratio above which the levers' ends nearly meet at the dead centre; no spring is as short as their distance
        # there.
        meets = _has_lever(shape) and shape[0] > 0.8 and _passes(robot, joint, shape[1])
        return not meets and super().is_plausible(robot, joint, coefficients, shape)

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists springs without levers, and levers if the joint moves far enough to determine them."""
        assert joint is not None
        # A joint that moves by less than 1 rad does not determine levers.
        return (LINEAR, PLAIN) if np.ptp(situation.q[:, joint - 1]) < 1.0 else self.forms(situation, joint)

    def forms(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists springs without levers, and for a revolute joint those with levers."""
        assert joint is not None
        if situation.robot.chain.joints[joint - 1].kind != "revolute":
            return (LINEAR, PLAIN)
        return (LINEAR, PLAIN, *((ratio, centre, PLAIN[2]) for ratio in RATIOS for centre in CENTRES))

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Fixes a spring without levers if the data do not determine a lever."""
        lever, centre, power = super().bounds(situation, joint)
        if len(self.grid(situation, joint)) == 2:
            return (0.0, 0.0), (0.0, 0.0), power
        return lever, centre, power

    def likely(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[float | None, ...], ...]:
        """Lists the springs without levers."""
        return LINEAR, PLAIN

    def row(self, robot: Robot, joint: int, at: Instant) -> casadi.SX:
        """Builds s s', s^2 s', s^3 s' (zero for a lever) and s'; the powers are zero for a linear spring."""
        # With the offset, any middle spans the same torques; the middle of the range gives a good conditioning.
        x = at.q - _middle(robot, joint)
        higher = at.shape[2] > LINEAR[2]
        plain = casadi.horzcat(x, higher * x**2, higher * x**3, 1.0)
        ratio, angle = at.shape[0], at.q - at.shape[1]
        length = casadi.sqrt(1.0 + ratio**2 - 2.0 * ratio * casadi.cos(angle))
        s, rate = (ratio - 2.0 * casadi.cos(angle)) / (length + 1.0), casadi.sin(angle) / length
        lever = casadi.horzcat(s, s**2, 0.0, 1.0) * rate
        has_lever = ratio >= SHORTEST_LEVER
        return has_lever * lever + (1.0 - has_lever) * plain

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
        if _has_lever(shape):
            # Ratio and dead centre are given with their intervals; many pairs fit about equally well.
            return f"A spring between two levers acts on joint {joint}."
        return (
            f"A spring or cable acts on joint {joint}: {coefficients[0]:.3g} {force}/{length} at the middle of its "
            "range."
        )

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Returns the position."""
        assert joint is not None
        unit = length_unit(situation.robot, joint - 1)
        return f"position of joint {joint} [{unit}]", situation.q[:, joint - 1]


def _has_lever(shape: tuple[float, ...]) -> bool:
    return bool(shape) and shape[0] >= SHORTEST_LEVER


def _passes(robot: Robot, joint: int, angle: float) -> bool:
    """Returns whether an angle, plus any number of turns, is within a joint's limits."""
    lower, upper = float(robot.limits.lower[joint - 1]), float(robot.limits.upper[joint - 1])
    return not np.isfinite(lower + upper) or lower + (angle - lower) % (2 * np.pi) <= upper


def _middle(robot: Robot, joint: int) -> float:
    lower, upper = float(robot.limits.lower[joint - 1]), float(robot.limits.upper[joint - 1])
    return (lower + upper) / 2 if np.isfinite(lower + upper) else 0.0
