"""Logs as JSON."""

import json

import numpy as np
import pytest

from estimation.logs import read_log
from robots.common.errors import InputError

T = [0.0, 0.004, 0.008]
Q = [[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]]
TAU = [[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]


def lines(rows):
    return "".join(json.dumps(row) + "\n" for row in rows)


LISTS = [{"t": t, "q": q, "tau": tau, "mode": "run", "names": ["a", "b"]} for t, q, tau in zip(T, Q, TAU, strict=True)]
NAMED = [{"t": t, "q1": q[0], "q2": q[1], "tau1": u[0], "tau2": u[1]} for t, q, u in zip(T, Q, TAU, strict=True)]


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("log.jsonl", lines(LISTS)),
        ("log.ndjson", lines(NAMED)),
        ("log.txt", lines(LISTS)),
        ("log.json", json.dumps(LISTS, indent=1)),
        ("log.json", json.dumps({"t": T, "q": Q, "tau": TAU})),
    ],
)
def test_rows_and_arrays_are_read(tmp_path, name, content):
    """Objects a line, a list of them, or one object of arrays give the same log; lists are the joints."""
    (tmp_path / name).write_text(content)
    log = read_log(tmp_path / name, n=2)
    assert log.t.tolist() == T
    assert log.q.tolist() == Q
    assert log.tau.tolist() == TAU


def test_fields_of_objects_and_dates_are_read_by_a_mapping(tmp_path):
    """Nested names have points between them; a time may be a date; a missing value is a gap."""
    rows = [
        {"stamp": f"2024-05-03T12:00:0{k}", "state": {"pos": q, "eff": tau}}
        for k, (q, tau) in enumerate(zip(Q, TAU, strict=True))
    ]
    rows[1]["state"]["eff"] = [None, 4.0]
    (tmp_path / "log.jsonl").write_text(lines(rows))
    (tmp_path / "map.yaml").write_text(
        "time: {column: stamp}\nposition: {columns: state.pos}\ntorque: {columns: state.eff}\n"
    )
    log = read_log(tmp_path / "log.jsonl", n=2, mapping=tmp_path / "map.yaml")
    np.testing.assert_array_equal(np.diff(log.t), [2.0])
    assert log.q.tolist() == [Q[0], Q[2]]
    assert log.tau.tolist() == [TAU[0], TAU[2]]


@pytest.mark.parametrize(
    ("content", "row", "word"),
    [
        (lines(LISTS) + '{"t": 0.012, "q": [0.', 4, "not JSON"),
        (lines([*NAMED, {**NAMED[0], "q1": "x"}]), 4, "'x'"),
        ("[1, 2]", 1, "found 1"),
        ("", None, "empty"),
    ],
)
def test_faults_name_the_line(tmp_path, content, row, word):
    """A line that was cut off, a word among numbers, and rows that are no objects."""
    (tmp_path / "log.jsonl").write_text(content)
    with pytest.raises(InputError, match=word) as caught:
        read_log(tmp_path / "log.jsonl", n=2)
    assert caught.value.row == row
