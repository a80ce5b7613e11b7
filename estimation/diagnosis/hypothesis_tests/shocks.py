"""Test whether a short effect is more than one shock of the noise, which has heavy tails and memory."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d
from scipy.signal import correlate

from estimation.diagnosis.calibration import MAX_GLITCH_SHARE, SHOCK_COUNT
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.problem import Group, Problem
from estimation.diagnosis.hypothesis_tests.scoring import Accepted, accept, score

Array = NDArray[np.float64]

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
