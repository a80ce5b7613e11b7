"""Recordings in forms that public recorders write: times in two columns, clocks with colons, headers behind a %."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from estimation import read_log
from robots.common.errors import InputError

T = np.arange(30) * 0.01
Q = np.column_stack([np.sin(T), np.cos(T)])


def _advised(path: Path) -> Path:
    """Saves the mapping that the refusal of a file prints."""
    with pytest.raises(InputError) as refused:
        read_log(path, 2)
    text = str(refused.value)
    mapping = path.with_suffix(".yaml")
    mapping.write_text(text[text.index("mapping.yaml:\n") + len("mapping.yaml:\n") :])
    return mapping


def test_seconds_and_nanoseconds_are_one_time(tmp_path: Path) -> None:
    """A header behind a % is read, and the advised mapping adds both columns of time."""
    path = tmp_path / "recorder.log"
    names = ["ZeitInSec", "ZeitInNanoSec", "axisTorqueMsr_LBR_1[0]", "axisTorqueMsr_LBR_1[1]", "axisQMsr_LBR_1[0]"]
    lines = ["% " + " ".join([*names, "axisQMsr_LBR_1[1]"])]
    for k, (t, q) in enumerate(zip(T, Q, strict=True)):
        lines.append(f"{1000 + int(t)} {round(1e9 * (t - int(t)))} {k} {2 * k} {q[0]:.9f} {q[1]:.9f}")
    path.write_text("\n".join(lines) + "\n")
    log = read_log(path, 2, mapping=_advised(path))
    np.testing.assert_allclose(log.t, 1000 + T, atol=1e-9)
    np.testing.assert_allclose(log.q, Q, atol=1e-8)
    np.testing.assert_allclose(log.tau, np.arange(30)[:, None] * [1, 2])


def test_text_in_a_column_of_nanoseconds_is_named(tmp_path: Path) -> None:
    """A mapping that names a column of text, or none, as nanoseconds is refused with its name."""
    path, mapping = tmp_path / "log.csv", tmp_path / "m.yaml"
    path.write_text("s,note,q1,tau1\n" + "".join(f"{k},a,{k},{k}\n" for k in range(3)))
    for column, problem in (("note", "holds text"), ("fine", "missing")):
        mapping.write_text(f"time: {{column: s, nanoseconds: {column}}}\n")
        with pytest.raises(InputError, match=problem) as refused:
            read_log(path, 1, mapping=mapping)
        assert refused.value.column == column


def test_a_clock_may_have_microseconds_behind_a_colon(tmp_path: Path) -> None:
    """Times such as 10:00:00:250000 are hours, minutes, seconds and microseconds."""
    path = tmp_path / "clock.csv"
    rows = [
        f"10:00:{int(t):02d}:{round(1e6 * (t % 1)):06d},{q[0]:.9f},{q[1]:.9f},1,2" for t, q in zip(T, Q, strict=True)
    ]
    path.write_text("time,q1,q2,tau1,tau2\n" + "\n".join(rows) + "\n")
    log = read_log(path, 2, mapping=_advised(path))
    np.testing.assert_allclose(log.t, 36000 + T, atol=1e-9)


def test_positions_alone_are_said_to_lack_torque(tmp_path: Path) -> None:
    """The refusal of a recording without torque says so."""
    path = tmp_path / "positions.csv"
    path.write_text("timestamp,cmdnum,J1,J2\n" + "".join(f"{t},1,{q[0]},{q[1]}\n" for t, q in zip(T, Q, strict=True)))
    with pytest.raises(InputError, match="no column looks like torque or current by its name"):
        read_log(path, 2)


def test_records_beside_a_description_are_the_table(tmp_path: Path) -> None:
    """A JSON file with one list of records is that list; what stands beside it is no column."""
    path = tmp_path / "log.json"
    entries = [{"timestamp": t, "position": q[0], "torque": 2.0} for t, q in zip(T.tolist(), Q.tolist(), strict=True)]
    path.write_text(json.dumps({"mass": 0.5, "entries": entries}))
    mapping = tmp_path / "m.yaml"
    mapping.write_text("time: {column: timestamp}\nposition: {columns: [position]}\ntorque: {columns: [torque]}\n")
    log = read_log(path, 1, mapping=mapping)
    np.testing.assert_allclose(log.q[:, 0], Q[:, 0])


def test_a_mapping_names_the_joints_of_a_printed_topic(tmp_path: Path) -> None:
    """A printed topic with other names of joints is refused with a mapping that works."""
    path = tmp_path / "topic.csv"
    names = [f"field.{key}{k}" for key in ("name", "position", "effort") for k in (0, 1)]
    rows = [f"{10**18 + round(1e9 * t)},b,a,{q[0]},{q[1]},1,2" for t, q in zip(T, Q, strict=True)]
    path.write_text(",".join(["%time", *names]) + "\n" + "\n".join(rows) + "\n")
    with pytest.raises(InputError, match=r"joints: \[b, a\]"):
        read_log(path, 2, joints=("J1", "J2"))
    mapping = tmp_path / "m.yaml"
    mapping.write_text("joints: [a, b]\n")
    np.testing.assert_allclose(read_log(path, 2, joints=("J1", "J2"), mapping=mapping).q, Q[:, ::-1])
