"""Stored logs: of another robot, of a model that does not fit, of another payload: each is named."""

import dataclasses

import numpy as np
import pytest

from estimation.monitoring import monitor_logs
from robots.common.errors import InputError
from robots.signals import Log


def foreign(arm, start, name):
    """A log whose torques are those of another robot of the type: other friction and masses."""
    scale = np.array([1.5, 0.7, 1.6, 0.6, 1.4, 0.8])
    return arm.log(start, 30.0, factor=lambda t: scale, extra=lambda t, i: 0.15 * arm.rigid[i], name=name)


@pytest.mark.slow
def test_a_log_of_another_robot_is_left_out(arm, monitor):
    """The log between others that fit is left out in one row, and the robot stays green."""
    logs = [arm.log(300.0 * k, 30.0, name=f"log {k}") for k in range(4)]
    logs[2] = foreign(arm, 600.0, "stranger")
    result = monitor_logs(monitor, logs)
    assert result.light == "green"
    (row,) = [row for row in result.logs if not row.used]
    assert row.name == "stranger"
    assert "another robot" in row.note
    assert "stranger: left out" in result.summary()


@pytest.mark.slow
def test_a_model_that_does_not_fit_any_more(arm, monitor):
    """Where all later logs differ in most joints, the model is the reason, and the light is red."""
    logs = [arm.log(300.0 * k, 30.0, name=f"log {k}") for k in range(2)]
    logs += [foreign(arm, 300.0 * k, f"log {k}") for k in (2, 3)]
    result = monitor_logs(monitor, logs)
    assert [f.kind for f in result.findings] == ["misfit"]
    assert result.light == "red"
    assert all(row.used for row in result.logs)


@pytest.mark.slow
def test_a_stated_payload_is_no_change(arm, monitor):
    """A log that states its payload gives no finding; the same log without the statement gives a payload."""
    torque = arm.payload(1.0)
    body = np.array([1.0, 0.0, 0.0, 0.1, 0.0104, 0.0, 0.0, 0.0104, 0.0, 0.0004])
    logs = [arm.log(0.0, 30.0), arm.log(300.0, 60.0, extra=lambda t, i: torque[i])]
    stated = [logs[0], dataclasses.replace(logs[1], payload=body)]
    assert monitor_logs(monitor.copy(), stated).findings == ()
    assert [f.kind for f in monitor_logs(monitor, logs).findings] == ["payload"]


def test_logs_of_another_type_are_refused(monitor):
    """A log with another number of joints, or one that states another robot, is named; alone it is an error."""
    t = 0.01 * np.arange(100)
    three = Log(t, np.zeros((100, 3)), np.zeros((100, 3)), name="three")
    named = Log(t, np.zeros((100, 6)), np.zeros((100, 6)), name="ur", metadata={"robot": "ur10"})
    with pytest.raises(InputError, match="another robot: 3 joints"):
        monitor_logs(monitor, [three])
    with pytest.raises(InputError, match="states robot ur10"):
        monitor_logs(monitor, [named])


@pytest.mark.slow
def test_result_is_saved_whole(arm, monitor, tmp_path):
    """monitor.json and trends.csv hold findings and a row per window and joint."""
    result = monitor_logs(monitor, [arm.log(0.0, 30.0, name="one")])
    result.save(tmp_path)
    assert (tmp_path / "monitor.json").read_text().startswith("{")
    lines = (tmp_path / "trends.csv").read_text().splitlines()
    assert len(lines) == 1 + 3 * 6
    with pytest.raises(InputError, match=r"exists|already"):
        result.save(tmp_path)
