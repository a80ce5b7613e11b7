"""A short external force on the arm."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np
from scipy.special import gamma

from robots.common.arrays import Array
from robots.terms.base import force_unit
from robots.terms.effect_bases.base import Coefficient, Effect, Place, Shape, Situation
from robots.terms.effect_bases.capabilities import GearLoad, Persistence
from robots.terms.effect_bases.states import spells

if TYPE_CHECKING:
    from robots.robot import Robot


PUSH_HARDNESS = 0.6  # hardness of a push between a half sine and a constant force
HOLD_HARDNESS = 0.1  # hardness of a nearly constant force
# A long push on a moving arm resembles a short one with constant torques while the arm moves least. Longer windows are
# therefore tried: factors on the duration, and where in the longer window the short one lies.
LONGER = (1.0, 2.0, 4.0, 8.0)
FROM = (0.0, 0.5, 1.0)
WRENCH = tuple(f"mean_{what}_{k}" for what in ("force", "moment") for k in "xyz")
# Force F at the point r of a body: F along the base's axes, r along the body's axes.
PLACED = tuple(f"place_{i}_force_{k}" for i in "xyz" for k in "xyz")


class ExternalContact(Effect):
    """tau_j = c_j p(t): a pulse of each joint's torque from the time t_0 for the duration d, p = sin(pi s)^h.

    The force may act anywhere on the arm. During a short pulse the pose is nearly constant, and so is each joint's
    torque. The hardness h gives a half sine (1), a constant (near 0), or a course between them.

    A longer push on a moving arm has one of two other formulas. Either a force and a moment on the flange, constant in
    the base frame: tau = J(q)' w p(t) / p_m. Or a force F, constant in the base frame, at a point r of one body:
    tau = J_b(q, r)' F p(t) / p_m, which is linear in F and in all r_i F_k. p_m is the mean of p over d, so w and F are
    mean values, which do not depend on the assumed course.
    """

    name: ClassVar[str] = "external_contact"
    title: ClassVar[str] = "external contact"
    persistence: ClassVar[Persistence] = Persistence.TRANSIENT
    gear_load: ClassVar[GearLoad] = GearLoad.CAUSES
    whole_robot: ClassVar[bool] = True
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("start", "s", -np.inf, np.inf, "linear", inexact=0.03),
        Shape("duration", "s", 0.03, 60.0, "log", (0.2, 0.5, 1.25, 3.2), 0.05),
        Shape("hardness", "", 0.05, 2.0, "log", (PUSH_HARDNESS,), 0.1, PUSH_HARDNESS),
        Shape("on_the_flange", "", 0.0, 1.0, "linear", (0.0,), default=0.0),
        Shape("on_body", "", 0.0, np.inf, "linear", (0.0,), default=0.0),
    )
    rivals: ClassVar[tuple[str, ...]] = ("payload_change", "hand_guiding", "friction_step", "torque_sensor_drift")
    experiments: ClassVar[tuple[str, ...]] = ("repeat",)

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the peak torque of each joint."""
        return self.described(robot, joint, ())

    def described(self, robot: Robot, joint: Place, shape: tuple[float, ...]) -> tuple[Coefficient, ...]:
        """Describes the joints' peak torques, or force and moment on the flange, or force and force times point."""
        if on_body(shape):
            named = [Coefficient(name, "N") for name in WRENCH[:3]] + [Coefficient(name, "N m") for name in PLACED]
        elif on_the_flange(shape):
            named = [Coefficient(name, "N" if "force" in name else "N m") for name in WRENCH]
        else:
            named = [Coefficient(f"peak_on_joint_{j + 1}", force_unit(robot, j)) for j in range(robot.n)]
        return (*named, *(Coefficient("", "") for _ in range(_count(robot.n) - len(named))))

    def is_plausible(self, robot: Robot, joint: Place, coefficients: Array, shape: tuple[float, ...] = ()) -> bool:
        """Returns whether the joints before the most loaded one are loaded as well.

        A force may cause no torque on the first joints, for example along a vertical first axis. If only the third
        joint or a later one is loaded, an error of that joint is more likely than a force on the arm.
        """
        size = np.abs(coefficients[: robot.n])
        most = int(np.argmax(size))
        pulse_only = not on_the_flange(shape) and not on_body(shape)
        # A joint below 5 % of the largest joint torque counts as unloaded.
        alone = pulse_only and most >= 2 and bool((size[:most] < 0.05 * size[most]).all())
        return not alone and super().is_plausible(robot, joint, coefficients, shape)

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists windows of several durations, with starts half a duration apart."""
        return tuple((*spell, PUSH_HARDNESS, 0.0, 0.0) for spell in spells(situation, self.shapes[1].grid))

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Bounds the contact to the data."""
        first, last = float(situation.t[0]), float(situation.t[-1])
        longest = min(self.shapes[1].upper, max(last - first, 0.1))
        hardness = (self.shapes[2].lower, self.shapes[2].upper)
        return (first, last), (self.shapes[1].lower, longest), hardness, (0.0, 0.0), (0.0, 0.0)

    def other_optima(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[tuple[float, ...], ...], ...]:
        """Lists longer pushes on the flange that contain this one."""
        if on_body(shape):
            return ()
        (first, last), (_, longest), *_ = self.bounds(situation, joint)
        start, duration, hardness = shape[:3]
        lasting = [min(duration * factor, longest) for factor in LONGER]
        return (
            tuple(
                (float(np.clip(start - share * (length - duration), first, last)), length, hard, 1.0, 0.0)
                for length in dict.fromkeys(lasting)
                for share in (FROM if length > duration else FROM[:1])
                for hard in (hardness, HOLD_HARDNESS)
            ),
        )

    def open_edges(self, shape: tuple[float, ...]) -> tuple[tuple[int, tuple[float, ...]], ...]:
        """Lists pushes of the same duration just before and just after this one.

        A push on a moving arm is not a pulse of constant joint torques, so its true edges may lie further out.
        """
        start, duration = shape[:2]
        times = ((0, start - duration), (1, start + duration))
        return tuple((k, (at, duration, HOLD_HARDNESS, 0.0, 0.0)) for k, at in times)

    def sustained_shapes(self, situation: Situation, shape: tuple[float, ...]) -> tuple[tuple[float, ...], ...]:
        """Lists constant forces at a point of each body, over all data."""
        if on_body(shape):
            return ()
        first, last = float(situation.t[0]), float(situation.t[-1])
        ever = (2 * first - last - 1.0, 3 * (last - first + 1.0), HOLD_HARDNESS)
        return tuple((*ever, 0.0, float(body + 1)) for body in range(situation.robot.n))

    def columns(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates a pulse on each joint, or the joints' torques by a force on the flange or a body (N, n, k)."""
        n, during = situation.robot.n, pulse(situation.t, shape)
        during = during / mean_of(shape[2]) if on_body(shape) or on_the_flange(shape) else during
        X = np.zeros((len(situation), n, _count(n)))
        acts = np.flatnonzero(during)
        if on_body(shape):
            links = situation.sensitivity("links")[acts]
            X[acts, :, : len(WRENCH[:3]) + len(PLACED)] = during[acts, None, None] * _at_body(
                situation.robot, links, round(shape[4])
            )
        elif on_the_flange(shape):
            X[acts, :, : len(WRENCH)] = during[acts, None, None] * situation.sensitivity("jacobian")[acts].transpose(
                0, 2, 1
            )
        else:
            X[:, range(n), range(n)] = during[:, None]
        return X

    def propose(
        self, situation: Situation, joint: Place, residual: Array, count: int = 8
    ) -> tuple[tuple[float, ...], ...]:
        """Ranks all windows by the residual's squared sum, relative to the median over windows of equal duration."""
        grid = self.grid(situation, joint)
        if len(grid) <= count:
            return grid
        sums = np.concatenate([np.zeros((1, residual.shape[1])), np.cumsum(residual, axis=0)])
        starts, durations = np.array(grid).T[:2]
        first = np.searchsorted(situation.t, starts + 0.1 * durations)
        last = np.searchsorted(situation.t, starts + 0.9 * durations)
        energies = (sums[last] - sums[first]) ** 2
        for duration in np.unique(durations):
            # Noise differs with the duration; 0.455 is the median of chi-square with one degree of freedom.
            own = energies[durations == duration]
            usual = np.array([np.median(some) / 0.455 if len(some := of[of > 0]) else 0.0 for of in own.T])
            energies[durations == duration] = np.divide(own, usual, out=np.zeros_like(own), where=usual > 0)
        scores = energies.sum(axis=1)
        return tuple(grid[i] for i in np.argsort(-scores)[:count])

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
        when = f"from t = {shape[0]:.2f} s for {shape[1]:.2g} s"
        if on_body(shape):
            push = float(np.linalg.norm(coefficients[:3]))
            return (
                f"Something pushed the arm {when}, with a constant force of {push:.3g} N at one place of body "
                f"{shape[4]:.0f} "
                "(mean values, along the base's axes; the signs are those of the arm's reaction)."
            )
        if on_the_flange(shape):
            # A component that causes no joint torque is zero up to rounding.
            push, turn = (float(np.linalg.norm(part)) for part in (coefficients[:3], coefficients[3:6]))
            sizes = (("force", push, "N"), ("moment", turn, "N m"))
            # A force below a millionth of the moment counts as none, and the reverse.
            least = 1e-6 * max(push, turn)
            parts = [f"a {word} of {size:.3g} {unit}" for word, size, unit in sizes if size > least]
            return (
                f"Something pushed the flange {when}, with {' and '.join(parts)}, constant (mean values, along the "
                f"base's "
                "axes; the signs are those of the arm's reaction)."
            )
        size = np.abs(coefficients)
        most, last = int(np.argmax(size)) + 1, int(np.flatnonzero(size > 0.05 * size.max())[-1]) + 1
        return (
            f"Something pushed the arm {when}. The largest torque is {size.max():.3g} {force} on joint {most}; joint "
            f"{last} is the last that shows it."
        )


def _count(joints: int) -> int:
    return max(joints, len(WRENCH[:3]) + len(PLACED))


def _at_body(robot: Robot, links: Array, body: int) -> Array:
    """Computes the joints' torques (N, n, 12) by unit forces on a body: at its origin, and per coordinate of the point.

    Args:
        robot: the robot with n joints.
        links: each link's rotation and origin (N, 12, n).
        body: the link, counted from 1.
    """
    turns, origins = links[:, :9].reshape(len(links), 3, 3, robot.n), links[:, 9:]
    axes = turns[:, :, :, body - 1]
    X = np.zeros((len(links), robot.n, len(WRENCH[:3]) + len(PLACED)))
    for j, joint in enumerate(robot.chain.joints[:body]):
        axis = turns[:, :, :, j] @ joint.axis
        if joint.kind != "revolute":
            X[:, j, :3] = axis
            continue
        X[:, j, :3] = np.cross(axis, origins[:, :, body - 1] - origins[:, :, j])
        # a . (R e_i x e_k) = (a x R e_i)_k
        X[:, j, 3:] = np.cross(axis[:, None], axes.transpose(0, 2, 1)).reshape(len(links), len(PLACED))
    return X


def on_the_flange(shape: tuple[float, ...]) -> bool:
    """Returns whether a push acts on the flange of a moving arm."""
    return len(shape) > 3 and shape[3] > 0.5


def on_body(shape: tuple[float, ...]) -> bool:
    """Returns whether a push acts at a point of a body of a moving arm."""
    return len(shape) > 4 and shape[4] > 0.5


def mean_of(hardness: float) -> float:
    """Computes the mean of sin(pi s)^h over s from 0 to 1."""
    return float(gamma(0.5 * hardness + 0.5) / (np.sqrt(np.pi) * gamma(0.5 * hardness + 1.0)))


def pulse(t: Array, shape: tuple[float, ...]) -> Array:
    """Evaluates sin(pi s)^h (N,) with s from 0 to 1 during the contact, and zero elsewhere.

    Args:
        t: time (N,) [s].
        shape: start and duration [s], and the hardness h, by default `PUSH_HARDNESS`.
    """
    hardness = shape[2] if len(shape) > 2 else PUSH_HARDNESS
    s = (t - shape[0]) / shape[1]
    during = (s > 0.0) & (s < 1.0)
    return np.where(during, np.sin(np.pi * np.where(during, s, 0.5)) ** hardness, 0.0)
