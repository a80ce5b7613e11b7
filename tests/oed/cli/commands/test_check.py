"""``oed check`` as its user calls it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest


@pytest.fixture
def write(tmp_path: Path, experiment: Path):
    """Write the experiment's log with changed columns."""
    table = pd.read_csv(experiment / "log.csv", comment="#")

    def call(name: str, drop: str = "", **columns: object) -> Path:
        changed = table.assign(**columns)
        kept = [column for column in changed if not (drop and column.startswith(drop))]
        changed[kept].to_csv(tmp_path / name, index=False)
        return tmp_path / name

    call.table = table
    return call


@pytest.mark.slow
def test_usable_logs_end_with_0(run, robot: Path, experiment: Path, write) -> None:
    """A good log is usable, and so is the motion of one without torque, which is said; nothing is written."""
    bare = write("bare.csv", drop="tau")
    before = sorted(experiment.iterdir())
    done = run("check", experiment / "log.csv", bare, "--robot", robot)
    assert done.code == 0, done.err
    assert done.out.count(": usable;") == 1
    assert "bare.csv: no torque, its motion is usable" in done.out
    assert "neither tau1..tau2 nor i1..i2" in done.out
    assert sorted(experiment.iterdir()) == before
    assert run("check", bare, "--robot", robot, "--quiet").out == ""


@pytest.mark.slow
@pytest.mark.parametrize("drop", ["", "tau"])
def test_one_useless_log_ends_with_1(run, robot: Path, experiment: Path, write, drop: str) -> None:
    """Degrees, milliseconds and wrapped angles are named, with and without torque; JSON lists the findings."""
    table = write.table
    spoilt = [
        write("deg.csv", drop, q1=np.rad2deg(table.q1), q2=np.rad2deg(table.q2)),
        write("ms.csv", drop, t=1e3 * table.t),
        write("wrap.csv", drop, q1=(table.q1 + 3.0 + np.pi) % (2 * np.pi) - np.pi),
    ]
    done = run("check", experiment / "log.csv", *spoilt, "--robot", robot, "--json")
    assert done.code == 1
    assert done.data["usable"] is False
    assert [log["refused"] for log in done.data["logs"]] == [False, True, True, True]
    names = [{finding["name"] for finding in log["findings"]} for log in done.data["logs"][1:]]
    for expected, found in zip(("unit_of_position", "unit_of_time", "wrapped_angle"), names, strict=True):
        assert expected in found


def test_bad_input_ends_with_2(run, robot: Path, tmp_path: Path) -> None:
    """A missing file and a file that is no log are bad input, each with one message."""
    (tmp_path / "other.csv").write_text("a,b\n1,2\n")
    for path in (tmp_path / "missing.csv", tmp_path / "other.csv"):
        done = run("check", path, "--robot", robot)
        assert (done.code, done.err.count("oed: ")) == (2, 1)
        assert str(path) in done.err


@pytest.mark.slow
def test_a_rate_stands_for_the_time(run, robot: Path, write, tmp_path: Path) -> None:
    """A log without times is refused with the option that reads it, and then judged as the log with its times is."""
    whole = write("whole.csv")
    bare = write("untimed.csv", drop="t")
    table = write.table.drop(columns="t")
    table.to_csv(bare, index=False)
    refused = run("check", bare, "--robot", robot)
    assert refused.code == 2
    assert "--rate 250" in refused.err
    period = float(np.median(np.diff(write.table["t"])))
    done = run("check", bare, "--robot", robot, "--rate", 1.0 / period, "--json")
    assert done.code == 0, done.err
    (found,) = done.data["logs"]
    (expected,) = run("check", whole, "--robot", robot, "--json").data["logs"]
    for key in ("samples", "duration", "unexplained"):
        np.testing.assert_allclose(found[key], expected[key], rtol=1e-3)
    both = run("check", bare, "--robot", robot, "--rate", -1)
    assert both.code == 2
    assert "rows per second" in both.err
