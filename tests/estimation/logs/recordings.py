"""Recordings in the formats of other programs, as these programs write them."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

N = 40
T = 0.004 * np.arange(N)


def motion(joints: int, seed: int = 0):
    """Positions, velocities and torques (N, joints) of a smooth motion."""
    rng = np.random.default_rng(seed)
    phase = rng.uniform(0.0, 6.0, joints)
    t = T[:, None]
    return np.sin(t + phase), np.cos(t + phase), 10.0 * np.sin(2.0 * t + phase)


def ur_rtde(path, t, q, dq, tau, *, torque=("actual_current",), delimiter=" ", temperature=False):
    """As ``record.py`` of UR's client library: csv.writer with blanks, each vector's joints from 0."""
    vectors = {"target_q": q, "target_qd": dq, "actual_q": q, "actual_qd": dq}
    vectors |= {name: tau / (10.0 if "current" in name and "torque" not in name else 1.0) for name in torque}
    if temperature:
        vectors["joint_temperatures"] = np.full_like(q, 31.5)
    with path.open("w", newline="") as stream:
        writer = csv.writer(stream, delimiter=delimiter)
        names = [f"{name}_{joint}" for name, values in vectors.items() for joint in range(values.shape[1])]
        writer.writerow(["timestamp", *names, "output_int_register_0", "robot_status_bits"])
        for row, time in enumerate(t):
            writer.writerow([time, *(x for values in vectors.values() for x in values[row].tolist()), 7, 1])
    return path


def libfranka(path, t, q, dq, tau, *, new=True):
    """As ``franka::logToCSV``: time in ms; the old form has names twice and an empty column before the commands."""
    state = {"q": q, "q_d": q, "dq": dq, "dq_d": dq, "tau_J": tau, "tau_ext_hat_filtered": 0 * tau}
    command = {"q_d": q, "dq_d": dq, "O_T_EE_d": np.zeros((len(t), 16)), "tau_J_d": 0 * tau}
    head = ["time", "success_rate"] if new else ["duration", " success rate"]
    for prefix, fields in (("state.", state), ("cmd.", command)):
        if not new and prefix == "cmd.":
            head.append("sent commands")
        for name, values in fields.items():
            numbered = [f"{prefix if new else ''}{name}[{joint}]" for joint in range(values.shape[1])]
            head += numbered if new else [numbered[0], *(f" {one}" for one in numbered[1:])]
    lines = [",".join(head)]
    for row, time in enumerate(t):
        parts = [[round(1e3 * time), 1.0], *(values[row] for values in state.values())]
        first = ",".join(repr(float(x)) for part in parts for x in part)
        second = ",".join(repr(float(x)) for values in command.values() for x in values[row])
        lines.append(first + ("," if new else ",,") + second)
    path.write_text("\n".join(lines) + "\n")
    return path


def franka_fields(path, t, q, dq, tau, *, milliseconds=False):
    """A table of a robot state's fields that a user's own loop writes."""
    columns = {"time": t * (1e3 if milliseconds else 1.0)}
    columns |= {f"O_T_EE_{index}": np.zeros(len(t)) for index in range(16)}
    for name, values in (("q", q), ("dq", dq), ("tau_J", tau), ("dtau_J", 0 * tau)):
        columns |= {f"{name}_{joint}": values[:, joint] for joint in range(values.shape[1])}
    return table(path, columns)


def franka_printed(path, t, q, dq, tau):
    """As ``std::cout << robot_state`` in a loop, between other lines of the program."""
    lines = ["WARNING: This example will move the robot!"]
    for row, time in enumerate(t):
        state = {"O_T_EE": [0.0] * 16, "m_ee": 0.73, "elbow": [0.1, -1]}
        state |= {"tau_J": tau[row].tolist(), "dtau_J": [0.0] * 7, "q": q[row].tolist(), "dq": dq[row].tolist()}
        state |= {"current_errors": [], "robot_mode": "Move", "time": round(1e3 * time)}
        lines.append(json.dumps(state))
    path.write_text("\n".join([*lines, "Done."]) + "\n")
    return path


def kuka_fri(path, t, q, dq, tau):
    """As ``collect_data`` of pyfri."""
    columns = {"index": np.arange(len(t)), "time": t, "record_time_nsec": 1e9 * t, "tsec": 5 + t, "tnsec": 0 * t}
    for name, values in (("mp", q), ("ip", q + 0.1), ("mt", tau), ("et", 0 * tau)):
        columns |= {f"{name}{joint + 1}": values[:, joint] for joint in range(values.shape[1])}
    return table(path, columns | {"dt": np.full(len(t), 0.004)})


def kuka_named(path, t, q, dq, tau):
    """A table with the names of the interface's functions."""
    columns = {"timestamp": t}
    for name, values in (("measuredJointPosition", q), ("measuredTorque", tau), ("externalTorque", 0 * tau)):
        columns |= {f"{name}[{joint}]": values[:, joint] for joint in range(values.shape[1])}
    return table(path, columns)


def rostopic(path, t, q, dq, tau, *, names):
    """As ``rostopic echo -p /joint_states``, joints in the order of the alphabet."""
    order = sorted(range(len(names)), key=lambda joint: names[joint])
    columns = {"%time": np.round(1e9 * (t + 2.0)).astype(int), "field.header.seq": np.arange(len(t))}
    columns |= {"field.header.stamp": np.round(1e9 * (t + 1.0)).astype(int), "field.header.frame_id": [""] * len(t)}
    columns |= {f"field.name{place}": [names[joint]] * len(t) for place, joint in enumerate(order)}
    for name, values in (("position", q), ("velocity", dq), ("effort", tau)):
        columns |= {f"field.{name}{place}": values[:, joint] for place, joint in enumerate(order)}
    return table(path, columns)


def savetxt(path, t, q, dq, tau):
    """As ``numpy.savetxt`` with a header."""
    joints = range(1, q.shape[1] + 1)
    names = ["t", *(f"q{joint}" for joint in joints), *(f"tau{joint}" for joint in joints)]
    np.savetxt(path, np.column_stack([t, q, tau]), header=" ".join(names))
    return path


def table(path, columns):
    """Comma separated columns."""
    with path.open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(columns)
        writer.writerows(zip(*(np.asarray(values).tolist() for values in columns.values()), strict=True))
    return path


@dataclass(frozen=True, kw_only=True)
class Format:
    """One format.

    Attributes:
        write: writes path, t, q, dq, tau.
        joints: how many the format has; 0 for any.
        torque: a column of its torque and one of its positions, for spoiling.
        position: the same.
        stamp: added to t by the format.
        source: what the reader says of the torque; None for a log's own names.
    """

    write: Callable[..., Path]
    joints: int
    torque: str
    position: str
    stamp: float = 0.0
    source: str | None


UR_NAMES = (
    *("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint"),
    *("wrist_1_joint", "wrist_2_joint", "wrist_3_joint"),
)

FORMATS = {
    "ur_rtde": Format(
        write=lambda *a: ur_rtde(*a, torque=("target_moment", "actual_current_as_torque")),
        joints=6,
        torque="actual_current_as_torque_3",
        position="actual_q_1",
        source="actual_current_as_torque_0 to actual_current_as_torque_5",
    ),
    "ur_rtde_commas": Format(
        write=lambda *a: ur_rtde(*a, torque=("target_moment",), delimiter=","),
        joints=6,
        torque="target_moment_3",
        position="actual_q_1",
        source="target_moment_0 to target_moment_5",
    ),
    "libfranka": Format(
        write=libfranka, joints=7, torque="state.tau_J[2]", position="state.q[6]", source="state.tau_J[0] to"
    ),
    "libfranka_old": Format(
        write=lambda *a: libfranka(*a, new=False), joints=7, torque="tau_J[2]", position="q[6]", source="tau_J[0] to"
    ),
    "franka_fields": Format(write=franka_fields, joints=7, torque="tau_J_2", position="q_6", source="tau_J_0 to"),
    "franka_milliseconds": Format(
        write=lambda *a: franka_fields(*a, milliseconds=True),
        joints=7,
        torque="tau_J_2",
        position="q_6",
        source="tau_J_0 to",
    ),
    "kuka_fri": Format(write=kuka_fri, joints=7, torque="mt2", position="mp7", source="mt1 to mt7"),
    "kuka_named": Format(
        write=kuka_named,
        joints=7,
        torque="measuredTorque[2]",
        position="measuredJointPosition[6]",
        source="measuredTorque[0] to",
    ),
    "rostopic": Format(
        write=lambda *a: rostopic(*a, names=UR_NAMES),
        joints=6,
        torque="field.effort2",
        position="field.position1",
        stamp=1.0,
        source="field.effort",
    ),
    "savetxt": Format(write=savetxt, joints=6, torque="tau3", position="q2", source=None),
}
