"""A compliant base that tilts and oscillates under the moment of the robot on it."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from scipy.linalg import solve_banded

from robots.common.arrays import Array
from robots.terms.effect_bases.base import Coefficient, Effect, Place, Shape, Situation
from robots.terms.effect_bases.parameters import DAMPING_RATIO
from robots.terms.effects.base_tilt import level_axes, tilted_torque, upright

if TYPE_CHECKING:
    from robots.robot import Robot


SCANNED = (*(3.5 * 1.1**k for k in range(18)), 30.0, 300.0)
"""Resonances [Hz] of a scan at the log's mean inertia, up to 18 in steps of a tenth: a resonance is narrow."""
COMPLIANCE_ERROR = 0.07
"""Relative error of compliance and stiffness in addition to that of the data: the base rotates about a point other than
its origin."""


class BaseCompliance(Effect):
    """tau = (d rigid/dg) (g x t) + (d rigid/dw) t' + (d rigid/da) t'': the base rotates by small angles t = C m.

    m is the moment of the robot on its base about the horizontal axes, by weight and accelerations, and C is symmetric.
    w and a are the base's angular velocity and acceleration. The base oscillates with the robot's inertia I, which
    couples both axes and depends on the pose: (I + J) t'' + (D + R) t' + K t = K C m. R is the robot's Coriolis matrix.
    The dynamic stiffness K, about each axis, the inertia J of the base itself and the damping ratio behind D are shape
    parameters; K C is the unit matrix for an ideal base. On a level robot with a vertical first axis, no log shows the
    first link's first moments. They tilt the base by an unknown angle o that rotates with the first joint.
    """

    name: ClassVar[str] = "base_compliance"
    title: ClassVar[str] = "compliant base"
    whole_robot: ClassVar[bool] = True
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("dynamic_stiffness_1", "N m/rad", 1e-6, 1e12, "log", inexact=COMPLIANCE_ERROR),
        Shape("dynamic_stiffness_2", "N m/rad", 1e-6, 1e12, "log", inexact=COMPLIANCE_ERROR),
        Shape("own_inertia", "kg m2", 0.0, np.inf, "linear", (0.0,), default=0.0, beside=True),
        Shape("damping_ratio", "", 1e-3, 0.5, "log", (DAMPING_RATIO,), default=DAMPING_RATIO, beside=True),
    )
    rivals: ClassVar[tuple[str, ...]] = ("joint_elasticity", "base_tilt", "spring")
    experiments: ClassVar[tuple[str, ...]] = ("multisine", "static_hold", "payload")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the compliances about both horizontal axes, their coupling, and the first link's tilt."""
        unit = "rad/(N m)"
        # Largest compliance [rad/(N m)], and largest tilt by the first link's own moments [rad].
        softest = 1e-3
        compliances = (
            Coefficient("compliance_1", unit, 0.0, softest, COMPLIANCE_ERROR),
            Coefficient("compliance_2", unit, 0.0, softest, COMPLIANCE_ERROR),
            Coefficient("compliance_12", unit, -softest, softest, COMPLIANCE_ERROR),
        )
        farthest = 0.3
        own = tuple(Coefficient(f"own_{axis}", "rad", -farthest, farthest) for axis in ("1", "2"))
        return (*compliances, *own) if upright(robot) else compliances

    def joints(self, robot: Robot) -> tuple[Place, ...]:
        """Returns the whole robot if gravity acts on it, else nothing."""
        return (None,) if np.any(robot.chain.gravity) else ()

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists stiffnesses for all pairs of the resonances in `SCANNED`."""
        pairs = [_stiffness(situation, f) for f in SCANNED]
        return tuple((one[0], other[1], 0.0, DAMPING_RATIO) for one, other in product(pairs, pairs))

    def propose(
        self, situation: Situation, joint: Place, residual: Array, count: int = 8
    ) -> tuple[tuple[float, ...], ...]:
        """Ranks the resonances about each axis by what that axis' compliance explains, the other axis alike."""
        pairs = [_stiffness(situation, f) for f in SCANNED]
        shown = []
        for pair in pairs:
            X = _torque(situation, _static(situation)[:, :, :2], (*pair, 0.0, DAMPING_RATIO))
            explained = np.einsum("njk,nj->k", X, residual)
            shown.append(np.maximum(explained, 0.0) ** 2 / np.maximum(np.einsum("njk,njk->k", X, X), 1e-300))
        score = np.array(shown)  # (resonances, 2)
        best = sorted(product(range(len(pairs)), repeat=2), key=lambda at: -(score[at[0], 0] + score[at[1], 1]))
        return tuple((pairs[one][0], pairs[other][1], 0.0, DAMPING_RATIO) for one, other in best[:count])

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Bounds the stiffness to usual resonances, and the base's own inertia to the robot's."""
        # Resonances from 2 to 1000 Hz.
        pairs = zip(_stiffness(situation, 2.0), _stiffness(situation, 1000.0), strict=True)
        damping = self.shapes[3]
        return (*pairs, (0.0, float(_inertia(situation).mean(axis=0).max())), (damping.lower, damping.upper))

    def likely(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[float | None, ...], ...]:
        """Lists combinations of the stiffness 1 / C, a light base and the usual damping with refined values."""
        stiffness: tuple[tuple[float | None, float | None], ...] = ((None, None),)
        ranges = self.bounds(situation, joint)[:2]
        first, second, both = coefficients[:3]
        if first * second > both**2:
            inverse = np.array([second, first]) / (first * second - both**2)
            ideal = [float(np.clip(value, *bound)) for value, bound in zip(inverse, ranges, strict=True)]
            stiffness = ((ideal[0], ideal[1]), (None, None))
        combinations = product(stiffness, (0.0, None), (DAMPING_RATIO, None))
        return tuple((*pair, own, damping) for pair, own, damping in combinations)[:-1]

    def is_plausible(self, robot: Robot, joint: Place, coefficients: Array, shape: tuple[float, ...] = ()) -> bool:
        """Rejects compliances that would give energy: their matrix is not positive."""
        first, second, both = coefficients[:3]
        return bool(first * second > both**2) and super().is_plausible(robot, joint, coefficients, shape)

    def columns(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque of all joints per compliance (N, n, 3), or per compliance and own angle (N, n, 5)."""
        robot = situation.robot
        torque = _torque(situation, _static(situation), shape)
        if not upright(robot):
            return torque
        axes, first, q = _axes(situation), robot.chain.joints[0], situation.q[:, 0, None, None]
        across = axes @ np.cross(first.rotation @ first.axis, axes).T  # e_i' (d x e_k)
        turned = np.cos(q) * np.eye(2) + np.sin(q) * across
        return np.concatenate([torque, tilted_torque(situation) @ turned], axis=2)

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
        softest = 1e3 * float(np.max(coefficients[:2]))
        return f"The base is compliant: it tilts by up to {np.degrees(softest):.2g} deg under 1000 N m."

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Returns the moment about the first horizontal axis."""
        return "moment on the base [N m]", _moment(situation)[:, 0]


def _axes(situation: Situation) -> Array:
    return level_axes(np.asarray(situation.robot.chain.gravity, dtype=float))


def _moment(situation: Situation) -> Array:
    """Computes the moment of the robot on its base about the horizontal axes (N, 2) [N m]."""
    return np.asarray(-situation.sensitivity("base_moment")[:, :, 0] @ _axes(situation).T)


def _static(situation: Situation) -> Array:
    """Computes the static tilts about both axes per compliance about axis 1, about axis 2, and of both (N, 2, 3)."""
    one, other = _moment(situation).T
    none = np.zeros_like(one)
    return np.stack([[one, none], [none, other], [other, one]]).transpose(2, 1, 0)


def _torque(situation: Situation, static: Array, shape: tuple[float, ...]) -> Array:
    """Computes the torque of all joints (N, n, k) on a base with static tilts (N, 2, k) that oscillates."""
    courses = _oscillation(situation, static, shape)
    rates = (situation.sensitivity(f"base_{kind}") @ _axes(situation).T for kind in ("rate", "acceleration"))
    parts = (tilted_torque(situation), *rates)
    return np.asarray(sum(X @ course for X, course in zip(parts, courses, strict=True)))


def _inertia(situation: Situation) -> Array:
    """Computes the robot's inertia about both horizontal axes (N, 2, 2) [kg m2], positive definite.

    A base model lacks the first link's inertia and may have a negative one, which would make the base unstable.
    """

    def positive() -> Array:
        own = _axes(situation) @ situation.sensitivity("base_inertia") @ _axes(situation).T
        values, vectors = np.linalg.eigh((own + own.transpose(0, 2, 1)) / 2)
        # Smallest inertia about any axis in any pose, as a fraction of the largest.
        least = 0.02 * max(float(values.max(initial=0.0)), 1e-9)
        return np.asarray((vectors * np.maximum(values, least)[:, None]) @ vectors.transpose(0, 2, 1))

    return situation.cached("inertia about the base", positive)


def _stiffness(situation: Situation, resonance: float) -> tuple[float, float]:
    """Computes the stiffnesses that give the log's mean inertia a resonance [Hz] about each axis."""
    first, second = (2 * np.pi * resonance) ** 2 * np.diag(_inertia(situation).mean(axis=0))
    return float(first), float(second)


def _oscillation(situation: Situation, static: Array, shape: tuple[float, ...]) -> tuple[Array, Array, Array]:
    """Computes the tilts of a base on a spring with the robot's inertia, and their first two time derivatives.

    Args:
        situation: the motion (N samples).
        static: static tilts about both axes (N, 2, k), by the moments that act on the base.
        shape: stiffness about each axis, own inertia and damping ratio.

    Returns:
        Tilts and derivatives (N, 2, k); static in logs whose resonances are both above 0.4 of the Nyquist frequency.
    """
    K, own, damping = np.array(shape[:2]), shape[2], shape[3]
    axes, inertia = _axes(situation), _inertia(situation) + own * np.eye(2)
    about = np.einsum("nkk->nk", inertia)
    lost = axes @ situation.sensitivity("base_damping") @ axes.T
    lost = lost + 2 * damping * np.sqrt(K * about)[:, :, None] * np.eye(2)
    tilt = static.copy()
    for run in situation.runs:
        w = np.sqrt(K / about[run].mean(axis=0))
        if run.stop - run.start < 3 or not 0 < w.min() * situation.period <= 0.4 * np.pi:
            continue
        # Bilinear rule, exact at the mean resonance: two rows of a banded system per sample, for the tilt beyond the
        # static one. It begins with none, because a log may begin in the middle of a motion.
        centre = float(np.clip(np.sqrt(w[0] * w[1]), w.min(), 0.4 * np.pi / situation.period))
        s = centre / np.tan(0.5 * centre * situation.period)
        x, rows = static[run], 2 * (run.stop - run.start)
        m, d, spring = s**2 * inertia[run][1:-1], s * lost[run][1:-1], np.diag(K)
        blocks = [m + d + spring, 2.0 * (spring - m), m - d + spring]  # of the sample itself and of the two before
        band = np.zeros((7, rows))
        band[1, :4] = 1.0
        for back, block in enumerate(blocks):
            for k, j in product(range(2), range(2)):
                first = 2 * (2 - back) + j
                band[1 + k - j + 2 * back, first : first + 2 * len(block) : 2] = block[:, k, j]
        push = -(m @ (x[2:] - 2.0 * x[1:-1] + x[:-2]) + d @ (x[2:] - x[:-2]))
        right = np.concatenate([np.zeros_like(x[:2]), push]).reshape(rows, -1)
        try:
            tilt[run] += solve_banded((5, 1), band, right).reshape(x.shape)
        except np.linalg.LinAlgError:
            # Inertia and damping of a base model that fits badly may have no motion of the base at all.
            continue
    return tilt, *situation.derivatives(tilt)
