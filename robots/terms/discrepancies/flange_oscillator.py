"""A swinging load at the flange, such as liquid in a tank or a hose, which acts on all joints."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from robots.common.arrays import Array
from robots.robot import Robot
from robots.terms.discrepancies.resonance import resonance
from robots.terms.effects import Coefficient, Effect, Shape, Situation

FREQUENCIES = tuple(float(f) for f in np.geomspace(0.4, 5.0, 24))
_WAYS = ("level", "upright")


class FlangeOscillator(Effect):
    """tau = -J(q)' f, f the force of masses on springs at the flange, which its acceleration p'' excites.

    x'' + 2 d w x' + w^2 x = -p'' in horizontal and in vertical direction, and f = m_1 w^2 x + m_2 w x'. The second
    coefficient allows for another damping. The drives act against f, so a mass has a positive coefficient.
    """

    name: ClassVar[str] = "pattern:swinging:0:even"
    title: ClassVar[str] = "swinging load at the flange"
    whole_robot: ClassVar[bool] = True
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("frequency", "Hz", 0.3, 6.0, "log", FREQUENCIES),)

    def parameters(self, robot: Robot, joint: int | None) -> tuple[Coefficient, ...]:
        """Describes the masses for the motion in phase and a quarter of a period late, in both directions."""
        return tuple(Coefficient(f"{phase}_{way}", "kg") for way in _WAYS for phase in ("mass", "late_mass"))

    def columns(self, situation: Situation, joint: int | None, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque per mass, horizontal and vertical, in both phases (N, n, 4)."""
        jacobian = situation.sensitivity("jacobian")[:, :3]
        pulls = situation.cached("flange acceleration", lambda: _accelerations(situation))
        X = np.empty((len(situation), situation.robot.n, 4))
        for k, pull in enumerate(np.moveaxis(pulls, 1, 0)):
            # The mass is excited by -p'', and the drives act against its force: the signs cancel.
            for phase, force in enumerate(resonance(situation, pull, shape[0])):
                X[:, :, 2 * k + phase] = np.einsum("tin,ti->tn", jacobian, force)
        return X

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
        return (
            "The residual torque of all joints matches a load at the flange that swings at "
            f"{shape[0]:.3g} Hz, with a mass of about {np.abs(coefficients).max():.2g} kg."
        )


def _accelerations(situation: Situation) -> Array:
    """Computes the horizontal and vertical parts of the flange's acceleration (N, 2, 3) [m/s2]."""
    velocity = np.einsum("tin,tn->ti", situation.sensitivity("jacobian")[:, :3], situation.dq)
    acceleration = situation.derivatives(velocity)[0]
    gravity = situation.gravity
    size = np.linalg.norm(gravity, axis=1, keepdims=True)
    up = np.where(size > 0, gravity / np.where(size > 0, size, 1.0), [0.0, 0.0, 1.0])
    upright = up * np.sum(up * acceleration, axis=1, keepdims=True)
    return np.stack([acceleration - upright, upright], axis=1)
