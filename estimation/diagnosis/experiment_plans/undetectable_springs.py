"""Springs and counterbalances that a log does not show, because gravity and offset of the base model absorb them."""

from __future__ import annotations

import numpy as np

from estimation.diagnosis.hypothesis_tests.power import detectable_energy
from estimation.diagnosis.hypothesis_tests.problem import Problem
from robots.terms.base import force_unit, length_unit

MOVED = 1e-3  # travel [rad or m] below which a joint has not moved


def undetectable_springs(problem: Problem, false_alarm: float) -> tuple[tuple[int, str], ...]:
    """Describes the joints on which a spring as large as the joint's torque RMS is not detectable.

    A spring's or counterbalance's torque is a smooth function of one position. Gravity, whose moments are free
    parameters, and offset fit such a function; the shorter the range, the better.

    Args:
        problem: data with the base model projected out.
        false_alarm: probability that noise alone gives a finding.

    Returns:
        Joint, counted from 1, and sentence.
    """
    robot, recording = problem.situation.robot, problem.recording
    torque = problem.rms
    needed = detectable_energy(1, robot.n, false_alarm=false_alarm)
    notes = []
    for j in range(robot.n):
        x = recording.q[:, j] - recording.q[:, j].mean()
        if np.ptp(x) < MOVED:
            continue
        group = problem.group((j,), (x[:, None],))
        energy = max(float(group.gram[0, 0]), 1e-300)
        stiffness = np.sqrt(needed / energy)
        own = stiffness * float(x.std())
        if own < torque[j]:
            continue
        force, length = force_unit(robot, j), length_unit(robot, j)
        size = f"{stiffness:.2g} {force}/{length} ({own:.2g} {force} RMS)" if energy > 1e-200 else "any size"
        text = (
            f"Joint {j + 1}: a spring or counterbalance of up to {size} cannot be detected. The joint moved only "
            f"{np.ptp(x):.2g} {length}, where gravity and offset of the base model fit a spring too."
        )
        notes.append((j + 1, text))
    return tuple(notes)
