"""An elastic gear: its deflection under load moves the link away from the encoder's position."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from scipy.linalg import solve_banded

from robots.common.arrays import Array
from robots.terms.base import force_unit, length_unit
from robots.terms.effect_bases.base import Coefficient, Effect, Place, Shape, Situation
from robots.terms.effect_bases.capabilities import AtReversals, GearLoad
from robots.terms.effect_bases.parameters import DAMPING_RATIO
from robots.terms.effect_bases.unknown_rotor import KNOWN_ROTOR, ROTOR, is_sure, load_beside, rotor_bounds, rotor_grid

if TYPE_CHECKING:
    from robots.robot import Robot


SCANNED = (3.5, 4.2, 5.0, 6.0, 7.2, 8.6, 10.4, 12.5, 15.0, 18.0, 30.0, 300.0)
"""Resonances [Hz] of a scan at the log's mean inertia; dense where motions excite them, because they are narrow."""
LARGEST_STIFFNESS_RATIO = 5.0
"""Largest ratio between the dynamic stiffness and the inverse compliance, which are equal for an ideal gear."""


class JointElasticity(Effect):
    """tau = -(d rigid/dq_j w + d rigid/d(dq_j) w' + M_j w'') c: torque change by the gear's deflection c w.

    c is the gear's compliance and w the link's load. It follows from M_jj w'' / K + w = tau_L, where tau_L is the load
    computed from the motor's motion. Above the resonance sqrt(K / M_jj), which depends on the pose, the link no longer
    follows the motor. The dynamic stiffness K equals 1 / c if the base model's link inertia is correct. The inertia of
    an unknown rotor is part of neither M nor tau_L. The damping is fitted, too: a wrong one biases compliance and rotor
    inertia where the motion excites the resonance.
    """

    name: ClassVar[str] = "joint_elasticity"
    title: ClassVar[str] = "joint elasticity (compliant gear)"
    at_reversals: ClassVar[AtReversals] = AtReversals.IMPACT
    gear_load: ClassVar[GearLoad] = GearLoad.FEELS
    # Errors of inertia and damping add to the error of the dynamic stiffness.
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("dynamic_stiffness", "N m/rad", 1e-6, 1e12, "log", inexact=0.05),
        ROTOR,
        Shape("damping_ratio", "", 1e-3, 0.5, "log", (DAMPING_RATIO,), default=DAMPING_RATIO, beside=True),
    )
    rivals: ClassVar[tuple[str, ...]] = ("backlash", "base_compliance", "time_delay", "current_lag", "encoder_offset")
    experiments: ClassVar[tuple[str, ...]] = ("multisine", "payload")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the compliance; a gear has at most 0.1 rad per N m."""
        assert joint is not None
        force, length = force_unit(robot, joint - 1), length_unit(robot, joint - 1)
        # Relative error of the compliance in addition to that of the data: the deflection also biases load and inertia.
        return (Coefficient("compliance", f"{length}/({force})", 0.0, 0.1, 0.03),)

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists stiffnesses for the resonances in `SCANNED`, for each rotor inertia of the scan."""
        assert joint is not None
        rotors = rotor_grid(situation, joint)
        return tuple(
            (_stiffness(situation, joint, f, rotor), rotor, DAMPING_RATIO) for rotor in rotors for f in SCANNED
        )

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Bounds the stiffness to resonances of usual gears, and the rotor inertia to its known range."""
        assert joint is not None
        rotor = rotor_bounds(situation, joint)
        # A gear resonates between 3 and 1000 Hz.
        softest = _stiffness(situation, joint, 3.0, rotor[1])
        damping = self.shapes[2]
        return (softest, _stiffness(situation, joint, 1000.0, rotor[0])), rotor, (damping.lower, damping.upper)

    def likely(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[float | None, ...], ...]:
        """Lists combinations of the stiffness 1 / c, the known rotor and the usual damping with refined values."""
        assert joint is not None
        stiffness: tuple[float | None, ...] = (None,)
        if coefficients[0] > 0:
            stiffness = (float(np.clip(1.0 / coefficients[0], *self.bounds(situation, joint)[0])), None)
        rotors: tuple[float | None, ...] = (KNOWN_ROTOR,) if is_sure(situation, joint) else (KNOWN_ROTOR, None)
        return tuple(product(stiffness, rotors, (DAMPING_RATIO, None)))[:-1]

    def is_plausible(self, robot: Robot, joint: Place, coefficients: Array, shape: tuple[float, ...] = ()) -> bool:
        """Rejects an oscillation whose dynamic stiffness is far from the inverse compliance."""
        ratio = float(coefficients[0]) * shape[0] if shape else 1.0
        return 1.0 / LARGEST_STIFFNESS_RATIO < ratio < LARGEST_STIFFNESS_RATIO and super().is_plausible(
            robot, joint, coefficients, shape
        )

    def columns(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque of all joints per compliance of one joint (N, n, 1)."""
        assert joint is not None
        stiffness, rotor, damping = shape
        inertia = least_inertia(situation, joint, rotor)
        load = followed(situation, load_beside(situation, joint, rotor), stiffness, inertia, damping)
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
        """Returns the second derivative of the load."""
        assert joint is not None
        rotor = shape[1] if len(shape) > 1 else KNOWN_ROTOR
        curve = situation.derivatives(load_beside(situation, joint, rotor))[1]
        unit = force_unit(situation.robot, joint - 1)
        return f"second derivative of the load of joint {joint} [{unit}/s2]", curve


def followed(
    situation: Situation, load: Array, stiffness: float, inertia: Array, damping: float = DAMPING_RATIO
) -> Array:
    """Filters a load by the dynamics of a link on an elastic gear.

    If the mean resonance is above 0.4 of the Nyquist frequency, the load is returned unchanged.

    Args:
        situation: the motion (N samples).
        load: load by the motor's motion (N,) [N m or N].
        stiffness: of the gear [N m/rad or N/m].
        inertia: of the link (N,) [kg m2 or kg].
        damping: ratio of the resonance.

    Returns:
        The link's load (N,) [N m or N].
    """
    w = float(np.sqrt(stiffness / np.mean(inertia)))
    if w * situation.period > 0.4 * np.pi or situation.period == 0.0:
        return load
    # Bilinear rule, exact at the mean resonance: one row of a banded lower triangular system per sample. Two samples
    # at rest are put before the log.
    k = 1.0 / np.tan(0.5 * w * situation.period)
    share = inertia / np.mean(inertia)
    stored, lost = k**2 * share, 2 * damping * k * np.sqrt(share)
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


def least_inertia(situation: Situation, joint: int, rotor: float = KNOWN_ROTOR) -> Array:
    """Returns the link inertia (N,) on a joint's gear, at least a fraction of its largest value.

    A wrist's inertia is so small that its fit may be negative, which would make the link unstable.
    """
    j = joint - 1
    own = situation.sensitivity("inertia")[:, j, j] - (situation.rotors[1, j] + rotor)
    # Smallest inertia of a joint in any pose, as a fraction of its largest.
    return np.asarray(np.maximum(own, 0.02 * max(float(np.abs(own).max(initial=0.0)), 1e-9)))


def _stiffness(situation: Situation, joint: int, resonance: float, rotor: float = KNOWN_ROTOR) -> float:
    """Computes the stiffness that gives the log's mean inertia a resonance [Hz]."""
    return float((2 * np.pi * resonance) ** 2 * np.mean(least_inertia(situation, joint, rotor)))


def link_inertia(situation: Situation, joint: int, rotor: float = KNOWN_ROTOR) -> Array:
    """Returns a joint's column of the links' inertia matrix (N, n), without described and additional rotor inertia."""
    column = _column(situation, "inertia", joint).copy(order="K")
    column[:, joint - 1] -= situation.rotors[1, joint - 1] + rotor
    return column


def _column(situation: Situation, kind: str, joint: int) -> Array:
    """Returns a joint's column of a sensitivity (N, n), contiguous by joints: many shapes of an effect multiply it."""
    return situation.cached((kind, joint), lambda: np.asfortranarray(situation.sensitivity(kind)[:, :, joint - 1]))


def windup(
    situation: Situation, joint: int, lag: Array, rate: Array, curve: Array, rotor: float = KNOWN_ROTOR
) -> Array:
    """Computes the torque change of all joints when a link lags its encoder, to first order.

    Args:
        situation: the motion and the base model's torque (N samples).
        joint: the joint, counted from 1.
        lag: by which the link lags (N,) [rad or m], or the lag per unit of a coefficient; the result is then per unit.
        rate: first time derivative of `lag` (N,).
        curve: second time derivative of `lag` (N,).
        rotor: additional rotor inertia [kg m2 or kg].

    Returns:
        Torque change (N, n) [N m or N].
    """
    total = _column(situation, "position", joint) * lag[:, None]
    total += _column(situation, "velocity", joint) * rate[:, None]
    total += link_inertia(situation, joint, rotor) * curve[:, None]
    return np.negative(total, out=total)
