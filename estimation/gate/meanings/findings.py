"""What is said of a reading under which the torques fit better than as logged, and what to state."""

from __future__ import annotations

import numpy as np

from estimation.gate.finding import Finding, Severity
from estimation.gate.meanings.changes import Change
from estimation.gate.meanings.search import Found
from estimation.gate.quick_fits.reading import Reading
from robots.robot import Robot

# Findings on each kind of change; torques of another size are named by `estimation.gate.meanings.torques`.
NAMES = {
    "gravity": "gravity_direction",
    "weightless": "torque_meaning",
    "coupled": "coupled_axes",
    "unit": "unit_of_position",
    "torque_unit": "unit_of_torque",
    "order": "swapped_columns",
}
# What else explains a log, in words.
LIKEWISE = {
    "joint_coupling": "coupled drives of these joints (joint_coupling), which oed diagnose names,",
    "base_tilt": "a tilted base (base_tilt), which oed diagnose names,",
}
WITHOUT_GRAVITY = "the torques seem to be without gravity, as those of a controller that compensates it"
TORQUE_IS = "--torque-is without-gravity (or `torque_is: without-gravity` in a mapping)"


def remedy(reading: Reading, prefix: str) -> str:
    """Writes what makes a log right: the whole mapping, and the option for gravity.

    Args:
        reading: of the log.
        prefix: of its torques or currents, ``tau`` or ``i``.
    """
    lines = reading.mapping(prefix)
    if lines == ["torque_is: without-gravity"]:
        return f"state {TORQUE_IS}: the gravity of the robot's description is then added"
    stated = [f"{' and '.join(f'`{line}`' for line in lines)} in a mapping (--mapping)"] if lines else []
    if reading.gravity is not None and reading.gravity.any():
        values = ",".join(f"{component:.3g}" for component in np.round(reading.gravity, 2) + 0.0)
        stated.append(f"it with --gravity K={values} (K: the number of the log, from 1)")
    return f"state {', and '.join(stated)}"


def reading_findings(robot: Robot, prefix: str, found: Found, action: str) -> list[Finding]:
    """Names each change of a reading, and states the whole reading with each.

    Args:
        robot: with n joints.
        prefix: of the log's torques or currents.
        found: the most likely reading.
        action: what makes the log right.
    """
    smaller = 100 * float(1 - np.exp(-found.better))
    severity: Severity = "refuse" if found.certain else "warning"
    also = f"; {LIKEWISE[found.likewise]} would explain it as well" if found.likewise else ""
    named: dict[tuple[str, int | None], Finding] = {}
    for change in found.changes:
        if change.kind == "size":
            continue
        name = NAMES.get(change.kind) or ("torque_sign" if change.reading.q_factor is None else "position_sign")
        own = change.kind in ("unit", "sign", "coupled")
        joint = change.joint + 1 if own else None
        column = f"{prefix if name == 'torque_sign' else 'q'}{joint}" if own else None
        why = f"errors are {smaller:.3g} % smaller" if smaller >= 1 else "it is then within the limits"
        text = f"{_words(robot, prefix, change, found.reading)}: {why}{also}"
        named[name, joint] = Finding(
            name=name, severity=severity, text=text, action=action, value=smaller, unit="%", column=column, joint=joint
        )
    return list(named.values())


def _words(robot: Robot, prefix: str, change: Change, whole: Reading) -> str:
    """Says what a change means."""
    joint, reading = change.joint, change.reading
    if change.kind == "weightless":
        return WITHOUT_GRAVITY
    if change.kind == "gravity":
        assert reading.gravity is not None
        values = ",".join(f"{component:.3g}" for component in np.round(reading.gravity, 2) + 0.0)
        return f"the base seems to be mounted otherwise than described, with gravity along ({values}) m/s2 in its frame"
    if change.kind == "coupled":
        return _coupled(robot, change)
    if change.kind == "torque_unit":
        return f"the torques of the joints do not fit one robot, and seem to be {change.words}"
    if change.kind == "order":
        orders = (("position", whole.q_from), ("torque" if prefix == "tau" else "current", whole.tau_from))
        other = [f"{key}s" for key, source in orders if source is not None and (np.diff(source) != 1).any()]
        return (
            f"the columns of {' and '.join(other)} seem to be in another order, with {'; '.join(whole.mapping(prefix))}"
        )
    if change.kind == "unit":
        assert reading.q_factor is not None
        degrees, twice = ("degrees", "radians") if robot.chain.kinds[joint] == "revolute" else ("millimetres", "metres")
        unit = degrees if reading.q_factor[joint] < 1 else f"turned into {twice} twice"
        return f"only this joint's position seems to be in another unit ({unit})"
    turned = "torque" if reading.q_factor is None else "position" if reading.tau_factor is None else None
    what = turned or "position and torque"
    return f"{robot.joint_names[joint]} seems to turn opposite to the robot's description in its {what}"


def _coupled(robot: Robot, change: Change) -> str:
    assert change.reading.coupling is not None
    axis, kinds = change.joint, robot.chain.kinds
    row = change.reading.coupling[axis]
    (other,) = (k for k in np.flatnonzero(row) if k != axis)
    factor = float(f"{row[other]:.3g}")
    if kinds[other] != kinds[axis]:
        drive = f"of a screw, {1e3 * 2 * np.pi * abs(factor):.3g} mm a turn"
    else:
        drive = "of an axis that is driven by a parallelogram or counted against the base"
    size = "" if abs(factor) == 1 else f"{abs(factor):g} "
    sign = "+" if factor > 0 else "-"
    return f"the position of joint {axis + 1} seems to be q{axis + 1} {sign} {size}q{other + 1}, as {drive}"
