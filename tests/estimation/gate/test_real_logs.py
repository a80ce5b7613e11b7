"""Specification of findings on measured logs: their known faults, and no refusal without a reason."""

import numpy as np
import pytest

from estimation import read_log
from estimation.gate import check_log
from robots.common.errors import NotIdentifiableError
from robots.loading import load_robot


def names(report, severity=None):
    return {finding.name for finding in report.findings if severity in (None, finding.severity)}


@pytest.mark.slow
def test_last_joints_of_tiago_are_badly_excited(data):
    """Joints arm_5 to arm_7 have almost no current: they are reported, and the log stays usable for the others."""
    folder = data("tiago_figaroh")
    joints = ["torso_lift_joint", *(f"arm_{number}_joint" for number in range(1, 8))]
    report = check_log(load_robot(folder / "tiago_48_schunk.urdf", joints=joints), read_log(folder / "run1.parquet"))
    assert not report.refused
    bad = [finding for finding in report.findings if finding.name == "badly_excited"]
    assert [finding.joint for finding in bad] == [6, 7, 8]
    assert all(joints[finding.joint - 1] in finding.text for finding in bad)
    assert (report.information[5:] < 10).all()
    assert (report.information[:5] > 10).all()


@pytest.mark.slow
def test_ur10_and_lwr_are_usable(data):
    """Logs that can be identified pass, with warnings on the small torques of the wrist only."""
    report = check_log(load_robot("ur10"), read_log(data("ur10_unisa") / "exciting.parquet"))
    assert not report.refused
    assert names(report, "warning") <= {"poorly_explained"}
    folder = data("kuka_lwr4_flobaroid")
    robot = load_robot(folder / "kuka_lwr4.urdf")
    for run in ("run1", "run2"):
        report = check_log(robot, read_log(folder / f"{run}.parquet"))
        assert not report.refused
        assert names(report, "warning") <= {"poorly_explained", "badly_excited"}
        assert {finding.joint for finding in report.of("warning")} <= {1, 5, 6, 7}


@pytest.mark.slow
def test_uneven_times_and_repeated_rows_of_panda_are_reported(data):
    """The time steps of the Panda vary, and 5 % of the rows repeat the row before."""
    report = check_log(load_robot("panda"), read_log(data("panda_gaz2019") / "traj1_first10s.parquet"))
    assert not report.refused
    assert {"jitter", "repeated_rows"} <= names(report)
    (repeated,) = (finding for finding in report.findings if finding.name == "repeated_rows")
    assert repeated.value == pytest.approx(5.4, abs=0.3)
    assert np.nanmax(report.unexplained) < 0.25


@pytest.mark.slow
def test_double_pendulum_runs_are_usable(data):
    """No run of the double pendulum is refused, and no unit is suspected, though joints exceed the described range."""
    folder = data("double_pendulum_dfki")
    robot = load_robot(folder / "dp_design_A.0_model_2.1_pendubot.urdf")
    for path in sorted(folder.glob("*.parquet")):
        report = check_log(robot, read_log(path))
        assert not report.refused, report.summary()
        assert not names(report) & {"unit_of_position", "unit_of_time", "unit_of_torque"}, report.summary()


def test_simple_pendulum_runs_are_distinguished(data):
    """Two swing-ups pass. An arm moved by hand and a run that oscillates are refused, with the reason."""
    folder = data("simple_pendulum_dfki")
    robot = load_robot(folder / "simple_pendulum.urdf", unlimited=True)
    for run in ("ddp", "dircol"):
        assert not check_log(robot, read_log(folder / f"{run}.parquet")).refused
    by_hand = check_log(robot, read_log(folder / "gravity_comp.parquet"))
    assert names(by_hand, "refuse") == {"moved_by_others"}
    with pytest.raises(NotIdentifiableError, match=r"sysid\.parquet.*badly excited"):
        check_log(robot, read_log(folder / "sysid.parquet")).raise_if_refused()
