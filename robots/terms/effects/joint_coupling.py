"""Two wrist joints with coupled drives, where one drive passes through the other joint."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import casadi

from robots.common.arrays import Array
from robots.terms.base import force_unit, length_unit
from robots.terms.effect_bases.base import Coefficient, Place, Shape, Situation
from robots.terms.effect_bases.static import Instant, StaticEffect

if TYPE_CHECKING:
    from robots.robot import Robot


WAYS = (1.0, -1.0)


class JointCoupling(StaticEffect):
    """For joints k and j = k - 1: tau_j = I ddq_k + a dq_k + F s, tau_k = I ddq_j + b dq_j + w F s.

    s = sign(dq_j + w dq_k), see Gautier 1995 for a rotor whose drive passes through another joint. Rotors and seals
    that both motions turn give a = b. Both are fitted independently, so that a coupling in one direction is found as
    well. The sign w is -1 if positive motions of both joints turn the seal between them in opposite directions. The
    effect is listed at the outer joint k.
    """

    name: ClassVar[str] = "joint_coupling"
    title: ClassVar[str] = "coupled drives of neighbouring joints"
    needs_full_rate: ClassVar[bool] = True
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("way", "", -1.0, 1.0, "linear", WAYS, default=1.0, beside=True, choices=WAYS),
    )
    rivals: ClassVar[tuple[str, ...]] = ("torque_crosstalk", "position_dependent_friction", "load_dependent_friction")
    experiments: ClassVar[tuple[str, ...]] = ("single_joint",)

    def joints(self, robot: Robot) -> tuple[Place, ...]:
        """Lists the last two joints; each is coupled with the joint before it."""
        return tuple(range(max(2, robot.n - 1), robot.n + 1))

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the coupled inertia, viscous friction in each direction, and Coulomb friction."""
        assert joint is not None
        force, length = force_unit(robot, joint - 1), length_unit(robot, joint - 1)
        return (
            Coefficient("coupled_inertia", f"{force} s2/{length}"),
            Coefficient("viscous_on_inner", f"{force} s/{length}"),
            Coefficient("viscous_on_outer", f"{force} s/{length}"),
            Coefficient("coupled_coulomb", force),
        )

    def likely(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[float | None, ...], ...]:
        """Lists both signs w."""
        return tuple((way,) for way in WAYS)

    def expression(self, robot: Robot, joint: Place, at: Instant) -> casadi.SX:
        """Builds the four columns on both joints."""
        assert joint is not None
        outer, inner, way = joint - 1, joint - 2, at.shape[0]
        X = casadi.SX(robot.n, 4)
        X[inner, 0], X[outer, 0] = at.ddq[outer], at.ddq[inner]
        X[inner, 1], X[outer, 2] = at.dq[outer], at.dq[inner]
        # The sign of a sum does not follow from the two smooth signs, so it has its own smoothing width.
        # Velocity [rad/s or m/s] of the smooth sign of the shared Coulomb friction.
        X[inner, 3] = casadi.tanh((at.dq[inner] + way * at.dq[outer]) / 5e-3)
        X[outer, 3] = way * X[inner, 3]
        return X

    def acts_on(self, robot: Robot, joint: Place) -> tuple[int, ...]:
        """Returns both joints, counted from 0."""
        assert joint is not None
        return joint - 2, joint - 1

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
        assert joint is not None
        return (
            f"Joints {joint - 1} and {joint} are coupled: motion of one needs torque of the other "
            f"({coefficients[1]:.3g} and {coefficients[2]:.3g} {force} s/{length}, {coefficients[3]:.3g} {force} of "
            f"Coulomb friction on their {'difference' if shape and shape[0] < 0 else 'sum'})."
        )

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Returns the velocity of the inner joint, which should not influence the outer one."""
        assert joint is not None
        unit = length_unit(situation.robot, joint - 2)
        return f"velocity of joint {joint - 1} [{unit}/s]", situation.dq[:, joint - 2]
