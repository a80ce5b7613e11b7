"""Acceptance of effects: BIC gain, beyond what formula errors of other effects or one shock of the noise explain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import maximum_filter1d
from scipy.signal import correlate

from estimation.diagnosis.calibration import MAX_GLITCH_SHARE, MIN_BIC_GAIN, SHOCK_COUNT
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.joint_agreement import per_joint_evidence
from estimation.diagnosis.hypothesis_tests.problem import Group, Problem
from estimation.diagnosis.hypothesis_tests.scoring import Accepted, accept, score
from robots.common.arrays import Array

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


# Number of positions between two white rows at which a shock is searched.
BETWEEN = 9
# The largest shocks elsewhere give the tail of the noise: this share of all, with a least and a largest number.
TAIL, FEWEST, MOST = 0.02, 5, 20


def gain_beside_shock(problem: Problem, member: FittedEffect, accepted: Accepted) -> FittedEffect:
    """Refits an effect beside the accepted groups and one noise shock, if the noise may contain such a shock.

    A single outlier of the innovations (innovational outlier, Fox 1972) makes a bump that decays like the noise, and a
    bump of white rows after the low-pass. With heavy tails, one of many thousands is as large as a contact.

    If the tail makes shocks of this size likely, one shock on each joint is fitted beside the effect. Otherwise one on
    a single joint is fitted, and counts only if it explains nearly all of the effect.

    Args:
        problem: data and base model.
        member: the effect.
        accepted: groups already in the model.

    Returns:
        The effect with its gain beside the shock, or unchanged.
    """
    joints, stride = member.group.joints, problem.whitening.stride
    acts = member.acts()
    left = problem.white - accepted.torque(problem.white)
    offsets = np.linspace(-0.5, 0.5, BETWEEN) * stride
    sizes = np.array([_sizes(problem, left, joints, float(offset)) for offset in offsets])  # (offsets, N, joints)
    within = np.where(acts, (sizes**2).sum(axis=2), -np.inf)
    best, place = (int(k) for k in np.unravel_index(int(np.argmax(within)), within.shape))
    reach = max(len(_bump(problem, j, 0.0)) for j in joints)
    elsewhere = np.where(maximum_filter1d(acts, reach)[:, None], 0.0, sizes[BETWEEN // 2])
    offset, largest = float(offsets[best]), int(np.argmax(sizes[best, place]))
    likely = _chance(problem, elsewhere, joints, float(sizes[best, place].max())) >= SHOCK_COUNT
    struck = joints if likely else joints[largest : largest + 1]
    beside = accept(problem, (*accepted.groups, _shock(problem, struck, place, offset)))
    gain = score(problem, member.group, beside).limited(member.hypothesis, problem.situation.robot, member.shape).gain
    return replace(member, gain=gain) if likely or gain < MAX_GLITCH_SHARE * member.gain else member


def _bump(problem: Problem, joint: int, offset: float) -> Array:
    """Returns the white rows of a unit shock, `offset` recording rows after the middle white row."""
    band, stride = problem.whitening.bands[joint], problem.whitening.stride
    if not len(band.taps):
        return np.ones(1)
    half = len(band.taps) // 2
    reach = half // stride + 1
    rows = stride * np.arange(-reach, reach + 1) - offset
    bump = np.interp(rows, np.arange(-half, half + 1), band.taps, 0.0, 0.0)
    return np.asarray(bump / np.linalg.norm(bump))


def _sizes(problem: Problem, left: Array, joints: tuple[int, ...], offset: float) -> Array:
    """Returns the best-fitting size of a shock (N, joints) at `offset` recording rows after each white row."""
    weights = problem.whitening.weights
    # Outliers have a smaller weight; the shock's full size is needed here.
    whole = left if weights is None else left / np.maximum(weights, 1e-3)
    columns = [correlate(whole[:, j], _bump(problem, j, offset), mode="same", method="direct") for j in joints]
    return np.abs(np.column_stack(columns))


def _chance(problem: Problem, sizes: Array, joints: tuple[int, ...], size: float) -> float:
    """Returns the expected number of noise shocks as large as `size`, by the tail of the others (Hill 1975)."""
    step = problem.recording.step * problem.whitening.stride
    peaks = []
    for k, j in enumerate(joints):
        width = max(1, round(1.0 / (problem.whitening.bands[j].cutoff * step)))
        whole = len(sizes) // width * width
        peaks.append(sizes[:whole, k].reshape(-1, width).max(axis=1))
    falling = np.sort(np.concatenate(peaks))[::-1]
    count = int(np.clip(TAIL * len(falling), FEWEST, MOST))
    if len(falling) <= count or falling[count] <= 0:
        return np.inf
    steepness = 1.0 / max(float(np.mean(np.log(falling[:count] / falling[count]))), 1e-6)
    return float(count * (falling[count] / max(size, falling[count])) ** steepness)


def _shock(problem: Problem, joints: tuple[int, ...], place: int, offset: float) -> Group:
    """Builds the group of a shock at `offset` recording rows after a white row, with one size per joint."""
    columns = []
    for k, j in enumerate(joints):
        bump = _bump(problem, j, offset)
        white = np.zeros((problem.rows, len(joints)))
        first = place - len(bump) // 2
        within = slice(max(first, 0), min(first + len(bump), problem.rows))
        white[within, k] = bump[within.start - first : within.stop - first]
        columns.append(problem.whitening.counted(white, j))
    return problem.white_group(joints, columns)
