"""Whether an effect is worth its parameters beside others, by what no other effect may leave of itself."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import maximum_filter1d

from estimation.diagnosis.calibration import MIN_BIC_GAIN
from estimation.diagnosis.hypothesis_tests.joint_agreement import per_joint_evidence, shared_coefficient_gain
from estimation.diagnosis.hypothesis_tests.log_noise_levels import profile_gain
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import FittedEffect
from estimation.diagnosis.hypothesis_tests.scoring import Accepted, accept, score
from estimation.diagnosis.hypothesis_tests.shocks import gain_beside_shock

# Time [s] before and after a kick of another effect, such as a link that lands, in which drives answer to it; what
# kicks in more than this share of the rows is none. Rows aside must tell this share of a delay.
ANSWERS, MOSTLY, ASIDE = 0.2, 0.8, 0.5
# But where no other effect acts, below this share of the false-alarm chance: no other formula leaves it there.
SURE = 0.2


def passes_bic(problem: Problem, candidate: FittedEffect, members: Sequence[FittedEffect]) -> bool:
    """Whether a candidate is worth its parameters beside members; the first one may have another size in each log."""
    worth = candidate.bic_gain - candidate.motion_error_chi2 if members else candidate.local_bic_gain
    if worth <= MIN_BIC_GAIN and not members and len(problem.recording.runs) > 1:
        worth += profile_gain(problem, candidate) - candidate.gain
    return worth > MIN_BIC_GAIN


def is_accepted(
    problem: Problem, candidate: FittedEffect, p_value: float, others: Sequence[FittedEffect], false_alarm: float
) -> bool:
    """Whether an effect is worth its parameters beside others, or sure without that."""
    return passes_bic(problem, candidate, others) or is_certain(problem, candidate, p_value, others, false_alarm)


def is_certain(
    problem: Problem, candidate: FittedEffect, p_value: float, others: Sequence[FittedEffect], false_alarm: float
) -> bool:
    """Whether an effect on joints where no other acts is far from chance, and worth its parameters at all."""
    joints = set(candidate.group.joints)
    apart = not any(joints.intersection(other.group.joints) for other in others)
    return apart and p_value < SURE * false_alarm and candidate.bic_gain - candidate.motion_error_chi2 > 0


def exceeds_single_shock(problem: Problem, candidate: FittedEffect, accepted: Accepted) -> bool:
    """Whether what acts for a moment is more than one shock of the noise."""
    return gain_beside_shock(problem, candidate, accepted).local_bic_gain > MIN_BIC_GAIN


def exceeds_leakage(problem: Problem, candidate: FittedEffect, members: Sequence[FittedEffect]) -> bool:
    """Whether a candidate is worth it by the joints alone on which it is more than what others may leave.

    What the torque as logged shows by itself, such as flat tops, no other formula leaves. Nor does one leave the same
    coefficient on joints that must agree on it: those on which another effect explains more must do no more than that.
    """
    hypothesis = candidate.hypothesis
    flags = hypothesis.effect.gate(problem.situation, hypothesis.joint, problem.recording.tau)
    if flags is not None and flags.any():
        return True
    if hypothesis.effect.shared_coefficient:
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
    """Whether a delay that all joints have alike is told by more than the answers of drives to another effect's kicks.

    A link that lands throws its motor back, which the log has for motion of motor and link alike: the torque, which
    answers to it, then seems to be ahead of that, on all joints that feel it.
    """
    kicks = [member for member in members if member.hypothesis.effect.acceleration_driven]
    if not kicks or not candidate.hypothesis.effect.shared_coefficient:
        return True
    reach = round(ANSWERS / (problem.recording.step * problem.whitening.stride))
    beside = np.zeros(problem.rows, dtype=bool)
    for member in kicks:
        near = maximum_filter1d(member.acts(), 2 * reach + 1)
        beside |= near & (near.mean() < MOSTLY)
    if not beside.any():
        return True
    accepted = accept(problem, tuple(m.group for m in members))
    per_joint = []
    for j, X in zip(*problem.columns_of(candidate.hypothesis, candidate.shape), strict=True):
        group = problem.group((j,), (X,), effect=candidate.hypothesis.effect)
        parts = score(problem, problem.split(group, np.ones(1), beside), accepted)
        if parts.gram[0, 0] > 0:
            # Whatever it is beside the kicks.
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
    """Whether joints on which no effect of theirs explains more tell a common coefficient by themselves."""
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
