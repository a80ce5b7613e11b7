"""Whether what acts for a moment is more than one shock of the noise: tails are heavy, and a memory spreads them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d
from scipy.signal import correlate

from estimation.diagnosis.calibration import MAX_GLITCH_SHARE, SHOCK_COUNT
from estimation.diagnosis.hypothesis_tests.groups import Group
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import FittedEffect
from estimation.diagnosis.hypothesis_tests.scoring import Accepted, accept, score

Array = NDArray[np.float64]

# Points between two white rows at which a shock is looked for.
BETWEEN = 9
# The largest shocks elsewhere tell the noise's tail: this share of all, so many at least and at most. Where as many as
# this are likely as large, it may be one.
TAIL, FEWEST, MOST = 0.02, 5, 20


def gain_beside_shock(problem: Problem, member: FittedEffect, accepted: Accepted) -> FittedEffect:
    """Measures what an effect explains beside what is accepted and one shock of the noise, if that may have been one.

    Noise with memory comes of innovations; a single one that is far out (an innovational outlier, Fox 1972) makes a
    bump that decays as the noise does, and in a band of low frequencies a bump of white rows. Where tails are heavy one
    of many thousands is as large as any push; but to be taken for one the noise would need two that meet. Where nothing
    else in the log comes near, it is a shock only of one joint that it explains nearly wholly.
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
    situation = problem.state_for(member.hypothesis.effect)
    gain, _ = score(problem, member.group, beside).bounded(
        *member.hypothesis.coefficient_bounds(situation.robot, member.shape)
    )
    return replace(member, gain=gain) if likely or gain < MAX_GLITCH_SHARE * member.gain else member


def _bump(problem: Problem, joint: int, offset: float) -> Array:
    """Gives the white rows of a shock of unit size, `offset` rows of the recording after the middle one of them."""
    band, stride = problem.whitening.bands[joint], problem.whitening.stride
    if not len(band.taps):
        return np.ones(1)
    half = len(band.taps) // 2
    reach = half // stride + 1
    rows = stride * np.arange(-reach, reach + 1) - offset
    bump = np.interp(rows, np.arange(-half, half + 1), band.taps, 0.0, 0.0)
    return np.asarray(bump / np.linalg.norm(bump))


def _sizes(problem: Problem, left: Array, joints: tuple[int, ...], offset: float) -> Array:
    """Gives the size of a shock on each joint (N, joints) that explains most, so many rows after each white row."""
    weights = problem.whitening.weights
    # As large as it was, not as it counts.
    whole = left if weights is None else left / np.maximum(weights, 1e-3)
    columns = [correlate(whole[:, j], _bump(problem, j, offset), mode="same", method="direct") for j in joints]
    return np.abs(np.column_stack(columns))


def _chance(problem: Problem, sizes: Array, joints: tuple[int, ...], size: float) -> float:
    """Gives how many shocks of a size the noise is expected to have, by the others' (N, joints): Hill's tail (1975)."""
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
    """Gives a shock so many rows of the recording after a white row: a size on each joint."""
    columns = []
    for k, j in enumerate(joints):
        bump = _bump(problem, j, offset)
        white = np.zeros((problem.rows, len(joints)))
        first = place - len(bump) // 2
        within = slice(max(first, 0), min(first + len(bump), problem.rows))
        white[within, k] = bump[within.start - first : within.stop - first]
        columns.append(problem.whitening.counted(white, j))
    return problem.white_group(joints, columns)
