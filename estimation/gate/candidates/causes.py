"""Causes of a bad fit that are tried: other gravity, units, signs and couplings of axes."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from estimation.gate.candidates.candidate_fits import STANDARD, CandidateFits, Meaning
from robots.robot import Robot

Array = NDArray[np.float64]

# A direction of gravity within this angle [rad] of the described one is the described one.
SAME = 0.03


@dataclass(frozen=True, eq=False)
class Cause:
    """A meaning of the log, and what kind of cause it would be.

    Attributes:
        kind: ``gravity``, ``weightless``, ``order``, ``unit`` or ``coupled``; or ``sign`` and ``size``, which other
            checks report.
        meaning: of the log.
        joint: counted from 0, for a unit or a coupled axis.
    """

    kind: str
    meaning: Meaning
    joint: int = 0


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


def coupled(robot: Robot, joints: list[int]) -> list[Cause]:
    """Lists axes that count another joint, too, and whose torques may act on the coupled axes."""
    causes = []
    for inner, outer in combinations(range(robot.n), 2):
        if not {inner, outer} & set(joints) or robot.chain.kinds[inner] != robot.chain.kinds[outer]:
            continue
        for factor in (1.0, -1.0):
            coupling = np.eye(robot.n)
            coupling[outer, inner] = factor
            for torques in (False, True):
                causes.append(Cause("coupled", Meaning(coupling=coupling, coupled_torques=torques), outer))
    return causes


def signs(robot: Robot, joints: list[int]) -> list[Cause]:
    """Lists joints that count the other way, in their position, their torque, or both."""
    causes = []
    for joint in joints:
        sign = np.ones(robot.n)
        sign[joint] = -1.0
        for q, tau in ((sign, sign), (sign, None), (None, sign)):
            causes.append(Cause("sign", Meaning(q_factor=q, tau_factor=tau), joint))
    return causes


def _angle(one: Array, other: Array) -> float:
    cosine = float(one @ other) / float(np.linalg.norm(one) * np.linalg.norm(other))
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)))
