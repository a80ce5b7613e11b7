"""What is said of a meaning under which the torques fit better than as logged."""

from __future__ import annotations

import numpy as np

from estimation.gate.candidates.candidate_fits import Meaning
from estimation.gate.candidates.causes import Cause
from estimation.gate.finding import Finding, Severity
from robots.robot import Robot


def cause_findings(robot: Robot, prefix: str, cause: Cause, better: float, certain: bool) -> list[Finding]:
    """Names a cause, and what to do about it; nothing for torques of another size, which another check reports.

    Args:
        robot: with n joints.
        prefix: of the log's torques or currents, ``tau`` or ``i``.
        cause: of its bad fit.
        better: decrease of the held-out error (mean log).
        certain: whether the log fits with this meaning only.
    """
    smaller = 100 * float(1 - np.exp(-better))
    severity: Severity = "refuse" if certain else "warning"
    if cause.kind == "size":
        return []
    if cause.kind == "weightless":
        return [
            without_gravity(
                f"errors are {smaller:.3g} % smaller if the torques carry no gravity", smaller, "%", certain
            )
        ]
    write = {
        "gravity": _gravity,
        "coupled": _coupling,
        "unit": _unit,
        "sign": _sign,
        "torque_unit": _torque_unit,
        "order": _order,
    }[cause.kind]
    return [write(robot, prefix, cause, severity, smaller)]


def without_gravity(why: str, value: float, unit: str, certain: bool) -> Finding:
    """Gives the finding of torques without gravity."""
    return Finding(
        name="torque_meaning",
        severity="refuse" if certain else "warning",
        text=f"the torques seem to be without gravity, as those of a controller that compensates it: {why}",
        action="state --torque-is without-gravity (or `torque_is: without-gravity` in a mapping): the gravity of the "
        "robot's description is then added",
        value=value,
        unit=unit,
    )


def opposite(joints: int, joint: int) -> str:
    """Writes what a mapping states for the opposite sign of one joint, counted from 0."""
    return f"`sign: [{', '.join('-1' if j == joint else '1' for j in range(joints))}]`"


def _gravity(robot: Robot, prefix: str, cause: Cause, severity: Severity, smaller: float) -> Finding:
    assert cause.meaning.gravity is not None
    values = ",".join(f"{component:.3g}" for component in np.round(cause.meaning.gravity, 2) + 0.0)
    return Finding(
        name="gravity_direction",
        severity=severity,
        text="the base seems to be mounted otherwise than described: errors are "
        f"{smaller:.3g} % smaller with gravity along ({values}) m/s2 in the base frame",
        action=f"state it with --gravity K={values} (K: the number of the log, from 1)",
        value=smaller,
        unit="%",
    )


def _unit(robot: Robot, prefix: str, cause: Cause, severity: Severity, smaller: float) -> Finding:
    assert cause.meaning.q_factor is not None
    factor = float(cause.meaning.q_factor[cause.joint])
    unit = {True: "degrees", False: "turned into radians twice"}[factor < 1]
    if robot.chain.kinds[cause.joint] == "prismatic":
        unit = {True: "millimetres", False: "turned into metres twice"}[factor < 1]
    scale = ", ".join(f"{value:.5g}" for value in cause.meaning.q_factor)
    return Finding(
        name="unit_of_position",
        severity=severity,
        text=f"only this joint's position seems to be in another unit ({unit}): errors are then {smaller:.3g} % "
        "smaller",
        action=f"state `scale: [{scale}]` for the position in a mapping (--mapping)",
        value=factor,
        column=f"q{cause.joint + 1}",
        joint=cause.joint + 1,
    )


def _sign(robot: Robot, prefix: str, cause: Cause, severity: Severity, smaller: float) -> Finding:
    joint = cause.joint
    turned = cause.meaning.q_factor is not None
    what = "position and torque" if turned and cause.meaning.tau_factor is not None else "position"
    return Finding(
        name="position_sign" if turned else "torque_sign",
        severity=severity,
        text=f"{robot.joint_names[joint]} seems to turn opposite to the robot's description: errors are "
        f"{smaller:.3g} % smaller with the opposite sign of its {what if turned else 'torque'}",
        action=f"state {opposite(robot.n, joint)} for the {what if turned else 'torque'} in a mapping (--mapping), "
        "times the signs that it has, or correct the description",
        value=smaller,
        unit="%",
        column=f"{'q' if turned else prefix}{joint + 1}",
        joint=joint + 1,
    )


def _torque_unit(robot: Robot, prefix: str, cause: Cause, severity: Severity, smaller: float) -> Finding:
    return Finding(
        name="unit_of_torque",
        severity=severity,
        text=f"the torques of the joints do not fit one robot: errors would be {smaller:.3g} % smaller if the torques "
        f"were {cause.words}",
        action="set the unit of tau in a mapping (--mapping)",
        value=smaller,
        unit="%",
    )


def _coupling(robot: Robot, prefix: str, cause: Cause, severity: Severity, smaller: float) -> Finding:
    assert cause.meaning.coupling is not None
    outer, kinds = cause.joint, robot.chain.kinds
    row = cause.meaning.coupling[outer]
    (inner,) = (k for k in np.flatnonzero(row) if k != outer)
    factor = float(f"{row[inner]:.3g}")
    if kinds[inner] != kinds[outer]:
        axis = f"of a screw, {1e3 * 2 * np.pi * abs(factor):.3g} mm a turn"
    else:
        axis = "of an axis that is driven by a parallelogram or counted against the base"
    size = "" if abs(factor) == 1 else f"{abs(factor):g} "
    torques = " and `coupled_torques: true`" if cause.meaning.coupled_torques else ""
    return Finding(
        name="coupled_axes",
        severity=severity,
        text=f"the position of joint {outer + 1} seems to be q{outer + 1} {'+' if factor > 0 else '-'} "
        f"{size}q{inner + 1}, as {axis}: errors are then {smaller:.3g} % smaller",
        action=f"state `coupling: {{{outer + 1}: {{{inner + 1}: {factor:g}}}}}`{torques} in a mapping (--mapping)",
        value=smaller,
        unit="%",
        column=f"q{outer + 1}",
        joint=outer + 1,
    )


def _order(robot: Robot, prefix: str, cause: Cause, severity: Severity, smaller: float) -> Finding:
    meaning: Meaning = cause.meaning
    lists, words = [], []
    key = "torque" if prefix == "tau" else "current"
    for name, column, source in (("position", "q", meaning.q_from), (key, prefix, meaning.tau_from)):
        assert source is not None
        if not np.array_equal(source, np.arange(len(source))):
            words.append(f"{name}s")
            lists.append(f"{name}: {{columns: [{', '.join(f'{column}{k + 1}' for k in source)}]}}")
    return Finding(
        name="swapped_columns",
        severity=severity,
        text=f"the columns of {' and '.join(words)} seem to be in another order: errors are {smaller:.3g} % smaller "
        f"with {'; '.join(lists)}",
        action="state this order in a mapping (--mapping), or correct the logger",
        value=smaller,
        unit="%",
    )
