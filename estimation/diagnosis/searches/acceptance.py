"""Acceptance of effects: BIC gain, beyond what errors of other effects' formulas or noise shocks can explain."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimation.diagnosis.calibration import MIN_BIC_GAIN
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.joint_agreement import per_joint_evidence
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.scoring import Accepted, accept
from estimation.diagnosis.hypothesis_tests.shocks import gain_beside_shock

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


def _joints_agree(problem: Problem, candidate: FittedEffect, members: Sequence[FittedEffect]) -> bool:
    """Whether the joints on which no other effect explains more determine a common coefficient."""
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
