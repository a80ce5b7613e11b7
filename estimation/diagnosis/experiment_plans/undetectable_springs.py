"""Springs and counterbalances that a log cannot show, however strong: what gravity and offset take for their own."""

from __future__ import annotations

import numpy as np

from estimation.diagnosis.hypothesis_tests.power import detectable_energy
from estimation.diagnosis.hypothesis_tests.problem import Problem
from robots.terms.base import force_unit, length_unit

MOVED = 1e-3  # [rad or m] below which a joint has not moved


def undetectable_springs(problem: Problem, false_alarm: float) -> tuple[tuple[int, str], ...]:
    """Says of which joints a spring as strong as all of their torque would be missed, in a sentence each.

    A spring's or a counterbalance's torque is a smooth function of one position. Over a short range gravity, whose
    moments are free parameters, and the offset follow any such function: the shorter the range, the better.

    Args:
        problem: the data, the base model projected out.
        false_alarm: chance of an effect in logs that have none.

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
