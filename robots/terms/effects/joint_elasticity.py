"""A gear that winds up under its load: the link is not where the encoder says."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter, lfilter_zi

from robots.terms.base import force_unit, length_unit
from robots.terms.effects.base import Coefficient, Effect, Place, Shape, Situation

if TYPE_CHECKING:
    from robots.robot import Robot

Array = NDArray[np.float64]

DAMPING = 0.05
"""Of the resonance, of its critical one."""


class JointElasticity(Effect):
    """tau = -(d rigid/dq_j w + d rigid/d(dq_j) w' + M_j w'') c: the torque of a link that lags by its wind-up c w.

    c is the gear's compliance, and w the load of the link: w''/(2 pi f)^2 + w = tau_L, tau_L the load by the motor's
    motion and f the resonance of link and gear, from which on the link follows the motor no more.
    """

    name: ClassVar[str] = "joint_elasticity"
    title: ClassVar[str] = "a gear that winds up under load (elasticity)"
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("resonance", "Hz", 3.0, 1000.0, "log", (8.0, 12.0, 18.0, 30.0, 60.0, 300.0)),
    )
    rivals: ClassVar[tuple[str, ...]] = ("backlash", "time_delay", "current_lag", "encoder_offset")
    experiments: ClassVar[tuple[str, ...]] = ("multisine", "payload")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the compliance; softer than a turn per the gravity of a small robot is no gear."""
        assert joint is not None
        force, length = force_unit(robot, joint - 1), length_unit(robot, joint - 1)
        return (Coefficient("compliance", f"{length}/({force})", 0.0, 0.1),)

    def columns(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque of all joints per compliance of one."""
        assert joint is not None
        load = followed(situation, situation.load[:, joint - 1], shape[0])
        return windup(situation, joint, load, *situation.derivatives(load))[:, :, None]

    def likely(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[float | None, ...], ...]:
        """Gives the resonance of the link that the base model describes on a gear of this compliance."""
        assert joint is not None
        inertia = float(np.mean(link_inertia(situation, joint)[:, joint - 1]))
        square = inertia * float(coefficients[0])
        if square <= 0:
            return ()
        lowest, highest = self.shapes[0].lower, self.shapes[0].upper
        return ((float(np.clip(1 / (2 * np.pi * np.sqrt(square)), lowest, highest)),),)

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
        return (
            f"The gear of joint {joint} winds up under load, with a stiffness of "
            f"{1.0 / max(coefficients[0], 1e-12):.3g} {force}/{length}."
        )

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Gives the second derivative of the load."""
        assert joint is not None
        curve = situation.derivatives(situation.load[:, joint - 1])[1]
        return f"second derivative of the load of joint {joint} [N m/s2]", curve


def followed(situation: Situation, load: Array, resonance: float) -> Array:
    """Passes a load (N,) through a resonance [Hz] that is damped by 5 %; one far above the samples' rate is none."""
    if resonance * situation.period > 0.2 or situation.period == 0.0:
        return load
    # The bilinear rule, true at the resonance.
    k = 2 * np.pi * resonance / np.tan(np.pi * resonance * situation.period)
    w = 2 * np.pi * resonance
    numerator = w**2 * np.array([1.0, 2.0, 1.0])
    middle = 2 * DAMPING * w * k
    denominator = np.array([k**2 + middle + w**2, 2 * (w**2 - k**2), k**2 - middle + w**2])
    state = lfilter_zi(numerator / denominator[0], denominator / denominator[0])
    result = np.empty_like(load)
    for run in situation.runs:
        start = state * load[run.start]
        result[run] = lfilter(numerator / denominator[0], denominator / denominator[0], load[run], zi=start)[0]
    return result


def link_inertia(situation: Situation, joint: int) -> Array:
    """Gives a joint's column of the links' inertia matrix (N, n), without its rotor."""
    column = situation.sensitivity("inertia")[:, :, joint - 1].copy()
    column[:, joint - 1] -= situation.rotors[1, joint - 1]
    return column


def windup(situation: Situation, joint: int, lag: Array, rate: Array, curve: Array) -> Array:
    """Gives the torque (N, n) by which all joints change when a link lags its encoder, to first order.

    Args:
        situation: what the robot did.
        joint: counted from 1.
        lag: by which the link lags (N,), with its two derivatives.
        rate: first derivative (N,).
        curve: second derivative (N,).
    """
    j = joint - 1
    return np.asarray(
        -situation.sensitivity("position")[:, :, j] * lag[:, None]
        - situation.sensitivity("velocity")[:, :, j] * rate[:, None]
        - link_inertia(situation, joint) * curve[:, None]
    )
