"""What the columns of a log mean: one question, and one answer that is complete."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimation.gate.context import Context
from estimation.gate.finding import Finding
from estimation.gate.meanings.comparison import mean_log
from estimation.gate.meanings.described import joint_evidence
from estimation.gate.meanings.findings import reading_findings, remedy
from estimation.gate.meanings.search import WELL, find_reading, joined, other_robot
from estimation.gate.meanings.signs import sign_findings
from estimation.gate.meanings.torques import likely_meaning, scale_of, torque_findings
from estimation.gate.quick_fits.reading import Reading
from estimation.gate.quick_fits.whole_fit import LIKE_A_CONSTANT
from robots.common.arrays import Array
from robots.common.plain import joints_in_words, percent, two_digits


def meanings(context: Context) -> list[Finding]:
    """Fits the log under other readings of its columns, and reports the one that explains the torques best.

    Columns, signs, units, couplings and gravity are compared by the held-out error of all joints together, and the size
    of the torques by the robot's description. A log is refused only if it does not fit as it is, and fits well with the
    other reading in all parts of the log. The checks that follow see the log as it is read.
    """
    prefix, logged = context.cleaned.columns.prefix, context.logged
    described = prefix == "tau" and context.robot.has_masses and (logged.unexplained < LIKE_A_CONSTANT).any()
    evidence = joint_evidence(logged) if described else []
    found = find_reading(logged, evidence)
    if (other := other_robot(logged, found)) is not None:
        return [_other_robot(*other)]
    context.reading = found.reading if found.changes else None
    robot, columns = context.robot, joined(change for change in found.changes if change.kind != "size")
    if any(change.whole for change in found.changes):
        evidence = []
    elif found.changes:
        logged = logged.read_as(columns)
        evidence = joint_evidence(logged) if evidence else []
    best = likely_meaning(robot, evidence)
    opposite, others = sign_findings(context.fitted, prefix, likely=best is None)
    turned = {finding.joint for finding in opposite}
    signs = np.array([-1.0 if joint + 1 in turned else 1.0 for joint in range(robot.n)])
    # Torques of coupled axes have no factors of their own behind the coupling.
    factors = scale_of(robot, best).then(Reading(tau_factor=signs))
    whole = columns if columns.coupled_torques else columns.then(factors)
    action = remedy(whole, prefix)
    return [
        *reading_findings(robot, prefix, found, action),
        *torque_findings(logged, evidence, best, whole),
        *(replace(finding, action=action) for finding in opposite),
        *others,
    ]


def _other_robot(wrong: NDArray[np.intp], left: Array, other: Array) -> Finding:
    shares = [f"{two_digits(100 * one[wrong].min())} to {percent(one[wrong].max())}" for one in (left, other)]
    return Finding(
        name="other_robot",
        severity="refuse" if mean_log(other) < np.log(WELL) else "warning",
        text="the log does not fit this robot's description, and may be of another robot: it leaves "
        f"{shares[0]} of the torques of {joints_in_words(wrong + 1)} unexplained, a model of any arm {shares[1]}",
        action="check --robot, and the axes and zeros of the joints in its description; no other order, sign, unit or "
        "gravity that was tried explains the log; if the robot is right, look for missing effects with oed diagnose",
        value=100 * float(1 - np.exp(mean_log(other) - mean_log(left))),
        unit="%",
    )
