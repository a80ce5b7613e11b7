"""What the torque columns of a log mean: hypotheses, and the evidence of each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.special import logsumexp

from estimation.gate.meanings.described import FACTORS, JointEvidence
from robots.robot import Robot

Factor = Callable[[JointEvidence], float]

# Gears of a drive that are possible where none is stated.
GEARS = (15.0, 400.0)
# Factors of currents [A] on the torque [N m], where other joints have torques. Other units are those of a whole log.
CURRENTS = (1 / 300, 3.0)
# Factors of other units on a torque. Those of single joints have none but these.
UNITS = {1e3: "mN m (N mm)", 1e-3: "kN m"}
# From this gear ratio on, a stated one is a gear.
GEARED = 2.0


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """One meaning of the torque columns.

    Attributes:
        kind: ``unit``, ``current``, ``percent``, ``motor``, ``weightless``, ``external`` or ``sign``.
        odds: log of its evidence over that of joint torques.
        joints: to which it applies, counted from 0.
        factors: most likely factor on the described torque of each of these joints.
        unit: of the torque, as its factor; None for no known one.
    """

    kind: str
    odds: float
    joints: tuple[int, ...]
    factors: tuple[float, ...]
    unit: float | None = None


def hypotheses(robot: Robot, evidence: Sequence[JointEvidence]) -> list[Hypothesis]:
    """Lists the meanings that a log may have, the most likely first.

    Joint torques are the described ones, times a factor near one that all joints share. Columns in one other unit
    share another factor. Currents have a factor of their own at each joint, which is one over the torque constant where
    it is stated. Motor torques have one over the gear. Both, and opposite signs, may be logged for some joints only.

    Args:
        robot: with n joints.
        evidence: of the joints that move.
    """
    shared = replace(
        evidence[0],
        described=np.sum([one.described for one in evidence], axis=0),
        multiple=np.sum([one.multiple for one in evidence], axis=0),
    )
    # The errors of a description are shared by the joints, or each joint has its own.
    own = sum(one.right() for one in evidence)
    right = float(np.logaddexp(shared.right(), own) - np.log(2))
    joints = tuple(one.joint for one in evidence)

    def whole(kind: str, log_evidence: float) -> Hypothesis:
        each = [shared if kind == "unit" else one for one in evidence]
        return Hypothesis(kind, log_evidence - right, joints, tuple(map(best_factor, each)))

    found = [
        whole("weightless", sum(one.weightless for one in evidence)),
        whole("external", sum(one.external for one in evidence)),
        whole("unit", shared.between(*FACTORS)),
        whole("current", sum(one.between(*FACTORS) for one in evidence)),
        _some("sign", evidence, right, lambda one: one.inverted),
        _some("current", evidence, right, lambda one: one.between(*CURRENTS)),
        _some("motor", evidence, right, _geared(robot)),
    ]
    for unit in UNITS:
        odds = shared.at(unit) - right - float(np.log(len(UNITS)))
        found.append(Hypothesis("unit", odds, joints, (best_factor(shared),) * len(joints), unit))
        found.append(replace(_some("unit", evidence, right, partial(JointEvidence.at, factor=unit)), unit=unit))
    for kind, scale in (("current", np.abs(robot.torque_constant)), ("percent", np.asarray(robot.limits.torque) / 100)):
        stated = np.asarray(scale, dtype=float)[list(joints)]
        if np.isfinite(stated).all() and (stated > 0).all():
            found.append(whole(kind, sum(one.at(1 / s) for one, s in zip(evidence, stated, strict=True))))
    return sorted(found, key=lambda one: -one.odds)


def best_factor(evidence: JointEvidence) -> float:
    """Gives the most likely factor on the described torque."""
    return float(np.exp(evidence.factors[np.argmax(evidence.multiple)]))


def _geared(robot: Robot) -> Factor:
    gears = np.abs(np.asarray(robot.gear_ratio, dtype=float))

    def factor(evidence: JointEvidence) -> float:
        gear = float(gears[evidence.joint])
        return evidence.at(1 / gear) if gear > GEARED else evidence.between(1 / GEARS[1], 1 / GEARS[0])

    return factor


def _some(kind: str, evidence: Sequence[JointEvidence], right: float, factor: Factor) -> Hypothesis:
    """Gives the hypothesis that each joint, as likely as not, has a factor."""
    kept, scaled = (np.array(values) for values in zip(*((one.right(), factor(one)) for one in evidence), strict=True))
    chosen = [one for one, more in zip(evidence, scaled > kept, strict=True) if more]
    total = float(np.sum(logsumexp([kept, scaled], axis=0) - np.log(2)))
    return Hypothesis(kind, total - right, tuple(one.joint for one in chosen), tuple(map(best_factor, chosen)))
