"""Stored logs: of another robot, of a model that does not fit, of another payload: each is named."""

import dataclasses

import numpy as np
import pytest

from estimation.monitoring import Monitor, MonitorSettings, monitor_logs
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
def test_a_lighter_robot_is_no_payload(arm, monitor):
    """Torques that friction of two joints and a body on the flange do not explain are of another robot."""
    logs = [arm.log(300.0 * k, 30.0, name=f"log {k}") for k in range(4)]
    # Friction is the model's. Of the masses, none is: the residual grows in all joints.
    share = -0.5 * np.sin(np.arange(len(arm.t)) / 40.0)[:, None]
    logs[2] = arm.log(600.0, 30.0, extra=lambda t, i: share[i] * arm.rigid[i], name="stranger")
    result = monitor_logs(monitor, logs)
    assert result.findings == ()
    assert [row.name for row in result.logs if not row.used] == ["stranger"]


@pytest.mark.slow
@pytest.mark.parametrize(("factor", "joint"), [(1.3, 3), (1.6, 5)])
def test_a_robot_that_was_damaged_before_its_first_log(arm, baseline, factor, joint):
    """Friction of one joint beyond the model's in all logs is a damage, from the first log on, with its size."""
    scale = np.where(np.arange(1, 7) == joint, factor, 1.0)
    logs = [arm.log(300.0 * k, 60.0, factor=lambda t: scale, name=f"log {k}") for k in range(3)]
    result = monitor_logs(Monitor(baseline, MonitorSettings(heat="common")), logs)
    (found,) = result.findings
    assert (found.kind, found.joint, found.from_start) == ("damage", joint, True)
    assert found.low < 100 * (factor - 1) < found.high
    assert found.size == pytest.approx(100 * (factor - 1), abs=3.0)
    assert result.light == "red"
    assert "first log already differs" in result.verdict()


@pytest.mark.slow
def test_positions_in_degrees_are_left_out(arm, monitor):
    """A log that the gate refuses is left out with the gate's reason, also as the first one."""
    logs = [arm.log(300.0 * k, 30.0, name=f"log {k}") for k in range(2)]
    logs[0] = dataclasses.replace(logs[0], q=np.degrees(logs[0].q))
    result = monitor_logs(monitor, logs)
    assert result.findings == ()
    assert "degrees" in result.logs[0].note
    assert result.logs[1].used


@pytest.mark.slow
def test_a_last_log_that_does_not_fit_is_watched_until_the_next(arm, monitor):
    """One log does not show whether it or the model is wrong. The next one does, in the same run or in a later one."""
    logs = [arm.log(300.0 * k, 30.0, name=f"log {k}") for k in range(2)]
    odd = [foreign(arm, 300.0 * k, f"log {k}") for k in (2, 3)]
    first = monitor_logs(monitor, [*logs, odd[0]])
    assert first.light == "amber"
    assert "log 2 does not fit" in first.verdict()
    same = monitor_logs(monitor, [odd[0]])
    assert same.light == "amber"
    healthy, later = monitor.copy(), monitor_logs(monitor, [odd[0], odd[1]])
    assert [f.kind for f in later.findings] == ["misfit"]
    assert later.light == "red"
    back = monitor_logs(healthy, [odd[0], arm.log(900.0, 30.0, name="log 4")])
    assert back.light == "green"
    assert "log 2: left out" in back.summary()


@pytest.mark.slow
def test_logs_are_counted_once(arm, monitor, tmp_path):
    """A folder that grows is given again and again: only new logs count, also after a restart, and copies never."""
    logs = [arm.log(300.0 * k, 30.0, name=f"log {k}", seed=k) for k in range(3)]
    monitor_logs(monitor, [*logs[:2], dataclasses.replace(logs[1], name="copy")])
    windows = len(monitor.evaluation.history.rows)
    assert windows == 6
    monitor.save(tmp_path / "state")
    again = Monitor.load(tmp_path / "state")
    result = monitor_logs(again, logs)
    assert len(again.evaluation.history.rows) == 9
    assert [row.name for row in result.logs] == ["log 0", "log 1", "log 2"]
    assert any("2 of 3 logs were counted" in note for note in result.notes)
    nothing = monitor_logs(again, logs)
    assert [row.name for row in nothing.logs] == ["log 0", "log 1", "log 2"]


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


@pytest.mark.slow
def test_a_contact_in_the_newest_log_is_watched_at_once(arm, monitor):
    """A push near the end of the last log makes the light amber, before later windows can confirm it."""

    def push(t, index):
        s = np.clip((t - 350.2) / 0.5, 0.0, 1.0)
        return np.sin(np.pi * s)[:, None] * np.array([0, 15.0, 10.0, 0, 3.0, 0])

    logs = [arm.log(300.0 * k, 60.0, extra=push, name=f"log {k}") for k in range(3)]
    first = monitor_logs(monitor, logs[:2])
    assert [(f.kind, f.settled) for f in first.findings] == [("contact", False)]
    assert first.light == "amber"
    assert "found in log 1" in first.verdict()
    later = monitor_logs(monitor, logs)
    assert [(f.kind, f.settled) for f in later.findings] == [("contact", True)]


@pytest.mark.slow
def test_pushes_do_not_make_a_log_foreign(arm, monitor):
    """Two strong pushes 15 s apart are no other robot: the log is used, and a contact is named."""

    def push(t, index):
        pulses = [np.sin(np.pi * np.clip((t - at) / 0.5, 0.0, 1.0)) for at in (325.2, 340.2)]
        return sum(pulses)[:, None] * np.array([4.0, 40.0, 25.0, 3.0, 6.0, 1.0])

    logs = [arm.log(300.0 * k, 60.0, extra=push, name=f"log {k}") for k in range(3)]
    result = monitor_logs(monitor, logs)
    assert all(row.used for row in result.logs)
    assert "contact" in {f.kind for f in result.findings}
