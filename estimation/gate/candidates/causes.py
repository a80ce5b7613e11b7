"""Causes of a bad fit that are tried: other gravity, units, signs and couplings of axes."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from estimation.gate.candidates.candidate_fits import STANDARD, CandidateFits, Meaning
from robots.robot import Robot

Array = NDArray[np.float64]

# A direction of gravity within this angle [rad] of the described one is the described one.
SAME = 0.03
# Shares of a slide's travel that an angle may make, as a first guess, and steps of the search for the best.
SHARES, REFINED = np.array([-1.0, -0.3, -0.1, 0.1, 0.3, 1.0]), 12
# Spread of a unit's factors over their largest, below which the joints agree equally well in both units.
SIMILAR = 0.2


@dataclass(frozen=True, eq=False)
class Cause:
    """A meaning of the log, and what kind of cause it would be.

    Attributes:
        kind: ``gravity``, ``weightless``, ``order``, ``unit``, ``coupled``, ``sign`` or ``torque_unit``; or ``size``,
            which another check reports.
        meaning: of the log.
        joint: counted from 0, for a unit, a sign or a coupled axis.
        words: what a torque unit is called.
    """

    kind: str
    meaning: Meaning
    joint: int = 0
    words: str = ""


def gravities(fits: CandidateFits) -> list[Cause]:
    """Lists other directions of gravity, none, and the described one that a controller has subtracted."""
    described = np.asarray(fits.robot.chain.gravity, dtype=float)
    size = float(np.linalg.norm(described))
    if not size > 0:
        return []
    directions = [sign * STANDARD * axis for axis in np.eye(3) for sign in (1.0, -1.0)]
    estimated = fits.described_gravity()
    if estimated is not None and np.linalg.norm(estimated) > 0.5 * STANDARD:
        directions.append(STANDARD * estimated / np.linalg.norm(estimated))
    others = [g for g in directions if _angle(g, described) > SAME]
    return [
        *(Cause("gravity", Meaning(gravity=direction)) for direction in others),
        Cause("weightless", Meaning(gravity=np.zeros(3))),
        *([Cause("weightless", Meaning(compensated=True))] if fits.robot.has_masses else []),
    ]


def units(robot: Robot, joints: list[int]) -> list[Cause]:
    """Lists other units of one joint's position: degrees or millimetres, or radians or metres twice."""
    causes = []
    for joint in joints:
        for factor in (np.pi / 180, 180 / np.pi) if robot.chain.kinds[joint] == "revolute" else (1e-3, 1e3):
            factors = np.ones(robot.n)
            factors[joint] = factor
            causes.append(Cause("unit", Meaning(q_factor=factors), joint))
    return causes


def coupled(fits: CandidateFits, joints: list[int]) -> list[Cause]:
    """Lists axes whose reading counts another joint, too, and whose torques may act on the coupled axes.

    An axis that a parallelogram drives reads one joint more or less. A slide on a ball screw spline reads a share of an
    angle: the best of a grid over the travels of both is refined.
    """
    robot, travel, causes = fits.robot, fits.travel, []
    for outer, inner in permutations(range(robot.n), 2):
        if not {inner, outer} & set(joints) or not travel[inner] > 0:
            continue
        if robot.chain.kinds[inner] == robot.chain.kinds[outer]:
            factors = [1.0, -1.0] if inner < outer else []
        else:
            grid = travel[outer] / travel[inner] * SHARES
            factors = [_refined_factor(fits, (outer, inner), grid)] if robot.chain.kinds[inner] == "revolute" else []
        for factor in factors:
            coupling = _coupling(robot.n, (outer, inner), factor)
            causes += [Cause("coupled", Meaning(coupling=coupling, coupled_torques=t), outer) for t in (False, True)]
    return causes


def _refined_factor(fits: CandidateFits, place: tuple[int, int], grid: Array) -> float:
    def cost(factor: float) -> float:
        return fits.cost(Meaning(coupling=_coupling(fits.robot.n, place, factor)), few=True)

    best = float(min(grid, key=cost))
    ends = (min(best / 2.0, best * 2.0), max(best / 2.0, best * 2.0))
    return float(minimize_scalar(cost, bounds=ends, options={"maxiter": REFINED}).x)


def _coupling(n: int, place: tuple[int, int], factor: float) -> Array:
    coupling = np.eye(n)
    coupling[place] = factor
    return coupling


def signs(robot: Robot, joints: list[int]) -> list[Cause]:
    """Lists joints that count the other way, in their position, their torque, or both."""
    causes = []
    for joint in joints:
        sign = np.ones(robot.n)
        sign[joint] = -1.0
        for q, tau in ((sign, sign), (sign, None), (None, sign)):
            causes.append(Cause("sign", Meaning(q_factor=q, tau_factor=tau), joint))
    return causes


def torque_units(robot: Robot) -> list[Cause]:
    """Lists torques in percent of the rated torque, and those of the motors, where they differ between the joints."""
    factors = {
        "in percent of the rated torque": np.asarray(robot.limits.torque) / 100.0,
        "the motor's, not the joint's": np.abs(np.asarray(robot.gear_ratio, dtype=float)),
    }
    return [
        Cause("torque_unit", Meaning(tau_factor=factor), words=words)
        for words, factor in factors.items()
        if np.isfinite(factor).all() and (factor > 0).all() and np.ptp(factor) > SIMILAR * factor.max()
    ]


def _angle(one: Array, other: Array) -> float:
    cosine = float(one @ other) / float(np.linalg.norm(one) * np.linalg.norm(other))
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)))
