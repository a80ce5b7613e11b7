"""Whether what an effect explains is there at all speeds at which it should be, and not in one line of the noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.problem import Group, Problem
from estimation.diagnosis.scoring import Accepted

Array = NDArray[np.float64]

# Ranges of the speed, of one energy each.
RANGES = 4
# What an effect is at different speeds may differ by this share, and by so many squared standard errors: its formula is
# no better, and a position loop yields to what is faster than it.
FORMULA, AGREES = 0.35, 2.0


def scatter_over_speeds(problem: Problem, group: Group, coefficients: Array, accepted: Accepted) -> float:
    """Gives how much more an effect's sizes at slow and fast motion of its joint differ than they may by chance.

    At constant speed an encoder's steps fold down to one line, and a wave that passes with the same frequency there
    explains it; at another speed it is not there (Birge ratio, one at least).

    Args:
        problem: the data.
        group: columns of one joint.
        coefficients: (k,).
        accepted: what is part of the model besides.
    """
    ((joint, columns),) = zip(group.joints, group.columns, strict=True)
    weights = accepted.root.T @ accepted.cross  # of the accepted columns
    parts = np.split(weights, np.cumsum([other.size for other in accepted.groups])[:-1]) if len(weights) else []
    known = list(zip(accepted.groups, parts, strict=True)) if len(weights) else []
    residual = problem.residual[:, joint].copy()
    for other, values in known:
        residual += problem.mixed[joint] @ (other.against.T @ values)
        for a, X in zip(other.joints, other.columns, strict=True):
            residual -= problem.whitening.precision[joint, a] * (X @ values)
    torque = columns @ coefficients
    energy = problem.whitening.precision[joint, joint] * torque**2
    told = [(_speed(problem, joint, problem.whitening.stride), torque * residual, energy)]
    above = problem.upper.joints[joint] if problem.upper is not None and group.above else None
    if above is not None and problem.upper is not None:
        left, torque = above.residual.copy(), group.above[0] @ coefficients
        for other, values in known:
            for a, X in zip(other.joints, other.above, strict=False):
                if a == joint:
                    left -= X @ values
        told.append((_speed(problem, joint, problem.upper.whitening.stride), torque * left, torque**2))
    speed, cross, energy = (np.concatenate(part) for part in zip(*told, strict=True))
    order = np.argsort(speed)
    total = np.cumsum(energy[order])
    if total[-1] <= 0:
        return 1.0
    place = np.minimum((RANGES * total / total[-1]).astype(int), RANGES - 1)
    expected, found = (np.bincount(place, values[order], RANGES) for values in (energy, cross))
    expected *= found.sum() / expected.sum()
    inside = expected > 0
    if found.sum() <= 0 or inside.sum() < 2:
        return 1.0
    # The size itself is known by all ranges together, and its square is the energy's unit.
    differ = (found - expected)[inside] ** 2 / (expected + (FORMULA * expected) ** 2)[inside]
    return max(1.0, float(differ.sum()) / (inside.sum() - 1) / AGREES)


def _speed(problem: Problem, joint: int, stride: int) -> Array:
    recording = problem.recording
    return np.concatenate([np.abs(recording.dq[run, joint])[::stride] for run in recording.runs])
