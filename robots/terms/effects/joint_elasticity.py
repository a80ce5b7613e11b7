"""A gear that winds up under its load: the link is not where the encoder says."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_banded

from robots.terms.base import force_unit, length_unit
from robots.terms.effect_bases.base import Coefficient, Effect, Place, Shape, Situation
from robots.terms.effect_bases.unknown_rotor import KNOWN, ROTOR, is_sure, load_beside, rotor_bounds, rotor_grid

if TYPE_CHECKING:
    from robots.robot import Robot

Array = NDArray[np.float64]

DAMPING = 0.05
"""Damping ratio of the resonance."""
INEXACT = 0.05
"""Share by which the stiffness by the dynamics errs besides: it is as right as the inertia and the damping are."""
OWN = 0.03
"""Share by which the compliance does: load and inertia of the link are those of a fit that winds up, too."""
SCANNED = (3.5, 4.2, 5.0, 6.0, 7.2, 8.6, 10.4, 12.5, 15.0, 18.0, 30.0, 300.0)
"""Resonances [Hz] of a scan, at the log's mean inertia: dense where a motion may excite them, for they are narrow."""
LIGHTEST = 0.02
"""Smallest inertia of a joint in any pose, as a fraction of its largest."""
APART = 5.0
"""Times by which the stiffness by the dynamics and that by the compliance differ at most: they are of one gear."""
LOWEST, HIGHEST = 3.0, 1000.0
"""Resonances [Hz] that a gear may have."""


class JointElasticity(Effect):
    """tau = -(d rigid/dq_j w + d rigid/d(dq_j) w' + M_j w'') c: the torque of a link that lags by its wind-up c w.

    c is the gear's compliance, and w the load of the link: M_jj w'' / K + w = tau_L, tau_L the load by the motor's
    motion. From the resonance sqrt(K / M_jj) on, which changes with the arm's pose, the link follows the motor no more.
    K, the stiffness by the dynamics, is 1 / c where the base model has the link's inertia right. A rotor that the
    robot's description does not tell is part of neither M nor tau_L.
    """

    name: ClassVar[str] = "joint_elasticity"
    title: ClassVar[str] = "joint elasticity (compliant gear)"
    depends_on_gear_load: ClassVar[bool] = True
    acceleration_driven: ClassVar[bool] = True
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("dynamic_stiffness", "N m/rad", 1e-6, 1e12, "log", inexact=INEXACT),
        ROTOR,
    )
    rivals: ClassVar[tuple[str, ...]] = ("backlash", "time_delay", "current_lag", "encoder_offset")
    experiments: ClassVar[tuple[str, ...]] = ("multisine", "payload")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the compliance; softer than a turn per the gravity of a small robot is no gear."""
        assert joint is not None
        force, length = force_unit(robot, joint - 1), length_unit(robot, joint - 1)
        return (Coefficient("compliance", f"{length}/({force})", 0.0, 0.1, OWN),)

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists the stiffnesses of some resonances, of the link without a rotor that is not known, too."""
        assert joint is not None
        rotors = rotor_grid(situation, joint)
        return tuple((_stiffness(situation, joint, f, rotor), rotor) for rotor in rotors for f in SCANNED)

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Bounds the resonance to usual gears, and the rotor to values near the known one."""
        assert joint is not None
        rotor = rotor_bounds(situation, joint)
        softest = _stiffness(situation, joint, LOWEST, rotor[1])
        return (softest, _stiffness(situation, joint, HIGHEST, rotor[0])), rotor

    def likely(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[float | None, ...], ...]:
        """Gives the stiffness that the compliance says, and the rotor that is known, or either alone."""
        assert joint is not None
        plain: tuple[tuple[float | None, ...], ...] = () if is_sure(situation, joint) else ((None, KNOWN),)
        if coefficients[0] <= 0:
            return plain
        stiffness = float(np.clip(1.0 / coefficients[0], *self.bounds(situation, joint)[0]))
        return (stiffness, KNOWN), *plain, *((stiffness, None) for _ in plain)

    def is_plausible(self, robot: Robot, joint: Place, coefficients: Array, shape: tuple[float, ...] = ()) -> bool:
        """Tells a gear from what swings as if on a spring of another stiffness than it winds up by."""
        ratio = float(coefficients[0]) * shape[0] if shape else 1.0
        return 1.0 / APART < ratio < APART and super().is_plausible(robot, joint, coefficients, shape)

    def columns(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque of all joints per compliance of one."""
        assert joint is not None
        stiffness, rotor = shape
        load = followed(situation, load_beside(situation, joint, rotor), stiffness, _inertia(situation, joint, rotor))
        return windup(situation, joint, load, *situation.derivatives(load), rotor)[:, :, None]

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
        return (
            f"The gear of joint {joint} is elastic, with a stiffness of "
            f"{1.0 / max(coefficients[0], 1e-12):.3g} {force}/{length}."
        )

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Gives the second derivative of the load."""
        assert joint is not None
        rotor = shape[1] if len(shape) > 1 else KNOWN
        curve = situation.derivatives(load_beside(situation, joint, rotor))[1]
        return f"second derivative of the load of joint {joint} [N m/s2]", curve


def followed(situation: Situation, load: Array, stiffness: float, inertia: Array) -> Array:
    """Passes a load (N,) through a link of changing inertia (N,) on a spring, damped by 5 %.

    One whose mean resonance is far above the samples' rate follows at once.
    """
    w = float(np.sqrt(stiffness / np.mean(inertia)))
    if w * situation.period > 0.4 * np.pi or situation.period == 0.0:
        return load
    # The bilinear rule, true at the mean resonance: one row of a lower triangular band a sample, after two at rest.
    k = 1.0 / np.tan(0.5 * w * situation.period)
    share = inertia / np.mean(inertia)
    stored, lost = k**2 * share, 2 * DAMPING * k * np.sqrt(share)
    result = np.empty_like(load)
    for run in situation.runs:
        x, m, d = (np.concatenate([values[run][:1]] * 2 + [values[run]]) for values in (load, stored, lost))
        m, d = m[1:-1], d[1:-1]
        band = np.ones((3, len(x)))
        band[0, 2:], band[1, 1:-1], band[2, :-2] = m + d + 1.0, 2.0 - 2.0 * m, m - d + 1.0
        band[1, 0] = 0.0
        right = np.concatenate([x[:2], x[2:] + 2.0 * x[1:-1] + x[:-2]])
        result[run] = solve_banded((2, 0), band, right)[2:]
    return result


def _inertia(situation: Situation, joint: int, rotor: float = KNOWN) -> Array:
    """Gives the inertia (N,) that swings on a joint's gear, no less than a share of its largest.

    A wrist's is so small that its fit may be negative: the link would then not swing but run away.
    """
    own = link_inertia(situation, joint, rotor)[:, joint - 1]
    return np.asarray(np.maximum(own, LIGHTEST * max(float(np.abs(own).max(initial=0.0)), 1e-9)))


def _stiffness(situation: Situation, joint: int, resonance: float, rotor: float = KNOWN) -> float:
    """Gives the stiffness on which the log's mean inertia has a resonance [Hz]."""
    return float((2 * np.pi * resonance) ** 2 * np.mean(_inertia(situation, joint, rotor)))


def link_inertia(situation: Situation, joint: int, rotor: float = KNOWN) -> Array:
    """Gives a joint's column of the links' inertia matrix (N, n), without its rotor, known or not."""
    column = situation.sensitivity("inertia")[:, :, joint - 1].copy()
    column[:, joint - 1] -= situation.rotors[1, joint - 1] + rotor
    return column


def windup(situation: Situation, joint: int, lag: Array, rate: Array, curve: Array, rotor: float = KNOWN) -> Array:
    """Gives the torque change (N, n) of all joints when a link lags its encoder, to first order.

    Args:
        situation: what the robot did.
        joint: counted from 1.
        lag: by which the link lags (N,), with its two derivatives.
        rate: first derivative (N,).
        curve: second derivative (N,).
        rotor: inertia of the joint that is a rotor's, beside what is known.
    """
    j = joint - 1
    return np.asarray(
        -situation.sensitivity("position")[:, :, j] * lag[:, None]
        - situation.sensitivity("velocity")[:, :, j] * rate[:, None]
        - link_inertia(situation, joint, rotor) * curve[:, None]
    )
