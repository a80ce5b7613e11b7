"""Acceptance of effects: BIC gain, beyond what errors of other effects' formulas or noise shocks can explain."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import maximum_filter1d

from estimation.diagnosis.calibration import IMPACT_SHARE, MIN_BIC_GAIN
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.joint_agreement import per_joint_evidence, shared_coefficient_gain
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.scoring import Accepted, accept, score
from estimation.diagnosis.hypothesis_tests.shocks import gain_beside_shock
from robots.terms.effect_bases.capabilities import AtReversals

# Time [s] before and after an impact of another effect in which the drives respond to it; share of the rows from which
# such times no longer count as impacts; share of a delay that the other rows must show.
ANSWERS, MOSTLY, ASIDE = 0.2, 0.8, 0.5
# p-value over the false-alarm threshold below which an effect is certain, on joints without other effects.
SURE = 0.2


def passes_bic(candidate: FittedEffect, members: Sequence[FittedEffect]) -> bool:
    """Whether the BIC gain of a candidate beside the members is sufficient.

    Args:
        candidate: effect, measured beside the members.
        members: effects in the model.
    """
    worth = candidate.bic_gain - candidate.motion_error_chi2 if members else candidate.local_bic_gain
    return worth > MIN_BIC_GAIN


def is_accepted(
    problem: Problem, candidate: FittedEffect, p_value: float, others: Sequence[FittedEffect], false_alarm: float
) -> bool:
    """Whether an effect has a sufficient BIC gain or is certain.

    Args:
        problem: whitened data.
        candidate: effect, measured beside the others.
        p_value: p-value of the effect.
        others: other effects in the model.
        false_alarm: threshold of the p-values.
    """
    return passes_bic(candidate, others) or is_certain(problem, candidate, p_value, others, false_alarm)


def is_certain(
    problem: Problem, candidate: FittedEffect, p_value: float, others: Sequence[FittedEffect], false_alarm: float
) -> bool:
    """Whether an effect on joints without other effects has a very small p-value and a positive BIC gain.

    Args:
        problem: whitened data.
        candidate: effect, measured beside the others.
        p_value: p-value of the effect.
        others: other effects in the model.
        false_alarm: threshold of the p-values.
    """
    joints = set(candidate.group.joints)
    apart = not any(joints.intersection(other.group.joints) for other in others)
    return apart and p_value < SURE * false_alarm and candidate.bic_gain - candidate.motion_error_chi2 > 0


def exceeds_single_shock(problem: Problem, candidate: FittedEffect, accepted: Accepted) -> bool:
    """Whether a transient effect has a sufficient BIC gain beside a single noise shock.

    Args:
        problem: whitened data.
        candidate: transient effect.
        accepted: effects in the model.
    """
    return gain_beside_shock(problem, candidate, accepted).local_bic_gain > MIN_BIC_GAIN


def exceeds_leakage(problem: Problem, candidate: FittedEffect, members: Sequence[FittedEffect]) -> bool:
    """Whether a candidate has a sufficient BIC gain on joints where formula errors of the members cannot explain it.

    Formula errors cannot explain an effect that the logged torque shows by itself, such as flat tops. If all joints
    share the coefficient, the joints on which the candidate explains more than their own effects must agree on it.

    Args:
        problem: whitened data.
        candidate: effect, measured beside the members.
        members: effects in the model.
    """
    hypothesis = candidate.hypothesis
    flags = hypothesis.effect.gate(problem.situation, hypothesis.joint, problem.recording.tau)
    if flags is not None and flags.any():
        return True
    if hypothesis.effect.delays_all_torque:
        return not members or _joints_agree(problem, candidate, members)
    robot = problem.situation.robot
    able = [
        j
        for j in candidate.group.joints
        if candidate.gain_on([j])
        >= max(
            (
                m.hypothesis.effect.leakage(robot, j, m.shape) * m.gain_on([j]) * candidate.share_beside(m, j)
                for m in members
            ),
            default=0.0,
        )
    ]
    lost = candidate.gain - candidate.gain_on(able)
    return not members or candidate.bic_gain - lost > MIN_BIC_GAIN


def delay_supported_away_from_impacts(
    problem: Problem, candidate: FittedEffect, members: Sequence[FittedEffect]
) -> bool:
    """Whether a shared delay is also significant away from impacts of an acceleration-driven effect.

    After backlash the link hits the other tooth flank and pushes the motor back. The base model takes the logged
    position for that of motor and link. The torque, which responds to the impact, then seems to be ahead of the motion
    on all joints that the impact reaches.

    Args:
        problem: whitened data.
        candidate: effect; any other than a shared delay passes.
        members: other effects in the model.
    """
    kicks = [member for member in members if member.hypothesis.effect.at_reversals is AtReversals.IMPACT]
    if not kicks or not candidate.hypothesis.effect.delays_all_torque:
        return True
    reach = round(ANSWERS / (problem.recording.step * problem.whitening.stride))
    beside = np.zeros(problem.rows, dtype=bool)
    for member in kicks:
        near = maximum_filter1d(member.acts(IMPACT_SHARE), 2 * reach + 1)
        beside |= near & (near.mean() < MOSTLY)
    if not beside.any():
        return True
    accepted = accept(problem, tuple(m.group for m in members))
    per_joint = []
    for j, X in zip(*problem.columns_of(candidate.hypothesis, candidate.shape), strict=True):
        group = problem.group((j,), (X,), effect=candidate.hypothesis.effect)
        parts = score(problem, problem.split(group, np.ones(1), beside), accepted)
        if parts.gram[0, 0] > 0:
            # Eliminates the coefficient in the rows near impacts.
            onto = parts.gram[1, 0] / parts.gram[0, 0]
            per_joint.append((parts.gram[1, 1] - onto * parts.gram[0, 1], parts.cross[1] - onto * parts.cross[0]))
    gram, cross = np.array([each for each in per_joint if each[0] > 0]).reshape(-1, 2).T
    if not len(gram):
        return False
    whole = float(candidate.coefficients[0])
    share = float(cross.sum() / gram.sum()) / whole if whole else 0.0
    paid = candidate.degrees * float(np.log(problem.rows * len(gram)))
    return share > ASIDE and shared_coefficient_gain(gram, cross) - paid > MIN_BIC_GAIN


def _joints_agree(problem: Problem, candidate: FittedEffect, members: Sequence[FittedEffect]) -> bool:
    """Whether the joints on which no other effect explains more determine a common coefficient."""
    if not delay_supported_away_from_impacts(problem, candidate, members):
        return False
    beside = accept(problem, tuple(m.group for m in members))
    evidence = per_joint_evidence(problem, candidate.hypothesis, candidate.shape, beside)
    others = [
        max((m.gain_on([j]) for m in members if m.hypothesis.joint == j + 1), default=0.0)
        for j in candidate.group.joints
    ]
    evidence = evidence.subset(
        (evidence.gram > 0) & (evidence.certain_share * evidence.cross**2 >= evidence.gram * others)
    )
    if not len(evidence.gram):
        return False
    return (
        evidence.gain(surely=True) - candidate.degrees * float(np.log(problem.rows * len(evidence.gram))) > MIN_BIC_GAIN
    )
