"""Single changes of how a log is read: other gravity, columns, signs, units and couplings of axes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np
from scipy.optimize import minimize_scalar

from estimation.gate.meanings.comparison import STANDARD, Comparison
from estimation.gate.quick_fits.reading import Reading, coupled, exchanged, scaled
from robots.common.arrays import Array
from robots.robot import Robot

# A direction of gravity within this angle [rad] of the described one is the described one.
SAME = 0.03
# Shares of a slide's travel that an angle may make, as a first guess, and steps of the search for the best.
SHARES, REFINED = np.array([-1.0, -0.3, -0.1, 0.1, 0.3, 1.0]), 12
# Spread of a unit's factors over their largest, below which the joints agree equally well in both units.
SIMILAR = 0.2
# Factors of other units on a position: of an angle, and of a slide.
UNITS = {"revolute": (np.pi / 180, 180 / np.pi), "prismatic": (1e-3, 1e3)}


@dataclass(frozen=True, eq=False)
class Change:
    """One change of a reading.

    Attributes:
        kind: ``gravity``, ``weightless``, ``order``, ``unit``, ``coupled``, ``sign``, ``torque_unit`` or ``size``.
        reading: the change alone.
        joint: counted from 0, for a unit, a sign or a coupled axis.
        words: what a torque unit is called.
        odds: log of the odds by the description against joint torques, for torques of another size.
    """

    kind: str
    reading: Reading
    joint: int = 0
    words: str = ""
    odds: float = 0.0

    @property
    def whole(self) -> bool:
        """Whether it concerns all joints, and not the columns of some."""
        return self.kind in ("gravity", "weightless", "torque_unit")


def gravities(fits: Comparison) -> Iterator[Change]:
    """Lists other directions of gravity, none, and the described one that a controller has subtracted."""
    described = np.asarray(fits.robot.chain.gravity, dtype=float)
    if not np.linalg.norm(described) > 0:
        return
    directions = [sign * STANDARD * axis for axis in np.eye(3) for sign in (1.0, -1.0)]
    estimated = fits.described_gravity()
    if estimated is not None and np.linalg.norm(estimated) > 0.5 * STANDARD:
        directions.append(STANDARD * estimated / np.linalg.norm(estimated))
    for direction in directions:
        if angle_between(direction, described) > SAME:
            yield Change("gravity", Reading(gravity=direction))
    yield Change("weightless", Reading(gravity=np.zeros(3)))
    if fits.robot.has_masses:
        yield Change("weightless", Reading(compensated=True))


def columns(robot: Robot, joints: list[int], bad: list[int]) -> Iterator[Change]:
    """Lists opposite signs, other units, and exchanged columns.

    Args:
        robot: with n joints.
        joints: that have a torque: a wrong sign may show at the joints that share the links.
        bad: those that are explained badly: one of them is concerned by a unit or an exchange.
    """
    n = robot.n
    for joint in joints:
        for q, tau in ((-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0)):
            yield Change("sign", scaled(n, joint, q=q, tau=tau), joint)
    for joint in bad:
        for factor in UNITS[robot.chain.kinds[joint]]:
            yield Change("unit", scaled(n, joint, q=factor), joint)
    for pair in combinations(range(n), 2):
        if set(pair) & set(bad):
            # Torques last: the regressor of the same positions is used again.
            for q, tau in ((True, True), (True, False), (False, True)):
                yield Change("order", exchanged(n, pair, q=q, tau=tau))
    straight = np.arange(n)
    for order in (straight[::-1], np.roll(straight, 1), np.roll(straight, -1)) if n > 2 and bad else ():
        yield Change("order", Reading(q_from=order, tau_from=order))


def couplings(fits: Comparison, joints: list[int]) -> Iterator[Change]:
    """Lists axes whose reading counts another joint, too, and whose torques may act on the coupled axes.

    An axis that a parallelogram drives reads one joint more or less. A slide on a ball screw spline reads a share of an
    angle: the best of a grid over the travels of both is refined.
    """
    kinds, travel, n = fits.robot.chain.kinds, np.ptp(fits.q, axis=0), fits.robot.n
    for axis, joint in permutations(range(n), 2):
        if not {joint, axis} & set(joints) or not travel[joint] > 0:
            continue
        if kinds[joint] == kinds[axis]:
            factors = [1.0, -1.0] if joint < axis else []
        else:
            grid = travel[axis] / travel[joint] * SHARES
            factors = [_refined_factor(fits, (axis, joint), grid)] if kinds[joint] == "revolute" else []
        for factor in factors:
            for torques in (False, True):
                yield Change("coupled", coupled(n, (axis, joint), factor, torques=torques), axis)


def _refined_factor(fits: Comparison, place: tuple[int, int], grid: Array) -> float:
    def cost(factor: float) -> float:
        return fits.cost(coupled(fits.robot.n, place, factor, torques=False), few=True)

    best = float(min(grid, key=cost))
    ends = (min(best / 2.0, best * 2.0), max(best / 2.0, best * 2.0))
    return float(minimize_scalar(cost, bounds=ends, options={"maxiter": REFINED}).x)


def torque_units(robot: Robot) -> Iterator[Change]:
    """Lists torques in percent of the rated torque, and those of the motors, where they differ between the joints."""
    factors = {
        "in percent of the rated torque": np.asarray(robot.limits.torque) / 100.0,
        "the motor's, not the joint's": np.abs(np.asarray(robot.gear_ratio, dtype=float)),
    }
    for words, factor in factors.items():
        if np.isfinite(factor).all() and (factor > 0).all() and np.ptp(factor) > SIMILAR * factor.max():
            yield Change("torque_unit", Reading(tau_factor=factor), words=words)


def angle_between(one: Array, other: Array) -> float:
    """Gives the angle [rad] between two directions (3,)."""
    cosine = float(one @ other) / float(np.linalg.norm(one) * np.linalg.norm(other))
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)))
