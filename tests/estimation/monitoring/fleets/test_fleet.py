"""Fleets: a row each, worst first; corrupt logs cost a row; what is done is not done again."""

import json

import numpy as np
import pytest

from estimation.monitoring import MonitorSettings
from estimation.monitoring.fleets import RobotRow, find_members, fleet, monitor_fleet
from robots.common.errors import InputError
from robots.common.files import write_atomic
from tests.estimation.monitoring.arm import write

SETTINGS = MonitorSettings(heat="none")


@pytest.fixture(scope="module")
def place(arm, tmp_path_factory):
    """Three robots: one healthy, one damaged between its logs, one without a readable log; and the model."""
    place = tmp_path_factory.mktemp("fleet")
    write_atomic(place / "model.json", json.dumps(arm.model.to_dict()))

    def worn(t):
        return np.where(t[:, None] >= 300.0, [1, 1, 1.4, 1, 1, 1], 1.0)

    for k in range(2):
        write(arm.log(300.0 * k, 30.0), place / "logs" / "healthy" / f"day{k}.csv")
        write(arm.log(300.0 * k, 60.0, factor=worn), place / "logs" / "robot=worn" / f"day{k}.csv")
    (place / "logs" / "healthy" / "day0b.csv").write_text("t,q1\nnonsense\n")
    (place / "logs" / "broken").mkdir()
    (place / "logs" / "broken" / "day1.csv").write_text("garbage")
    return place


@pytest.mark.slow
def test_worst_first_and_resumed(place, arm, tmp_path, monkeypatch):
    """Red before grey before green; a second run does nothing, and a new log continues the kept monitor."""
    run = {"kept": tmp_path / "kept", "settings": SETTINGS, "workers": 1}
    first = monitor_fleet(place / "logs", place / "model.json", **run)
    assert [(row.name, row.light) for row in first.rows] == [("worn", "red"), ("broken", "grey"), ("healthy", "green")]
    worn = first.rows[0]
    assert "Joint 3" in worn.text
    assert {f.joint for f in worn.findings} == {3}
    assert first.rows[2].left_out == 1
    assert first.resumed == 0
    assert first.verdict() == "3 robots: 1 need action, 1 without a usable log, 1 without a finding."
    calls = []
    send = fleet.monitor_logs
    monkeypatch.setattr(fleet, "monitor_logs", lambda *a, **k: calls.append(len(a[1])) or send(*a, **k))
    again = monitor_fleet(place / "logs", place / "model.json", **run)
    assert again.resumed == 3
    assert calls == []
    assert [row.to_dict() for row in again.rows] == [row.to_dict() for row in first.rows]
    (tmp_path / "kept" / "worn.json").unlink()
    third = monitor_fleet(place / "logs", place / "model.json", **run)
    assert calls == [2]  # as after a kill: only the robot that was not done
    assert third.rows[0].text == worn.text
    write(arm.log(600.0, 30.0), place / "logs" / "healthy" / "day2.csv")
    monitor_fleet(place / "logs", place / "model.json", **run)
    assert calls == [2, 1]
    (place / "logs" / "healthy" / "day2.csv").unlink()


def test_rows_survive_their_files():
    """A row that is read from its file is the row."""
    row = RobotRow.failed("one", "no rows")
    assert RobotRow.from_dict(json.loads(json.dumps(row.to_dict(whole=True))), whole=True) == row


def test_folders_that_are_no_fleet(tmp_path):
    """No folder, no logs, and two robots of one name are refused."""
    with pytest.raises(InputError, match="no such folder"):
        find_members(tmp_path / "absent")
    with pytest.raises(InputError, match="no logs"):
        find_members(tmp_path)
    for name in ("robot=a", "a"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "log.csv").write_text("t")
    with pytest.raises(InputError, match="two robots of the name a"):
        find_members(tmp_path)


@pytest.mark.slow
def test_logs_of_one_robot_are_no_fleet(place, arm, tmp_path):
    """Logs directly in the folder are robots of their own; the summary says so, and which command takes them as one."""
    for k in range(2):
        write(arm.log(300.0 * k, 30.0), tmp_path / "logs" / f"day{k}.csv")
    found = monitor_fleet(tmp_path / "logs", place / "model.json", kept=tmp_path / "kept", settings=SETTINGS, workers=1)
    assert "Each was taken as a robot of its own" in found.summary()
    folders = monitor_fleet(place / "logs", place / "model.json", kept=tmp_path / "k", settings=SETTINGS, workers=1)
    assert "robot of its own" not in folders.summary()
