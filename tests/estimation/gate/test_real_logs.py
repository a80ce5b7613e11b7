"""What the gate says of measured logs: their known oddities, and no refusal without a reason."""

import numpy as np
import pytest

from estimation import read_log
from estimation.gate import check_log
from robots.common.errors import NotIdentifiableError
from robots.loading import load_robot


def names(report, severity=None):
    return {finding.name for finding in report.findings if severity in (None, finding.severity)}


def test_tiago_is_told_to_be_badly_excited_on_its_last_joints(data):
    """Its joints arm_5 to arm_7 have almost no current: they are named, and the log stays usable for the others."""
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
    """Logs that carry an identification pass; what is said of them are small torques of the wrist."""
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


def test_panda_is_told_its_uneven_time_and_repeated_rows(data):
    """The Panda's clock jitters, and six in a hundred rows repeat the row before."""
    report = check_log(load_robot("panda"), read_log(data("panda_gaz2019") / "traj1_first10s.parquet"))
    assert not report.refused
    assert {"jitter", "repeated_rows"} <= names(report)
    (repeated,) = (finding for finding in report.findings if finding.name == "repeated_rows")
    assert repeated.value == pytest.approx(5.4, abs=0.3)
    assert np.nanmax(report.unexplained) < 0.25


@pytest.mark.slow
def test_double_pendulum_runs_are_usable(data):
    """No run of the double pendulum is refused; joints beyond the description's range are told as such."""
    folder = data("double_pendulum_dfki")
    robot = load_robot(folder / "dp_design_A.0_model_2.1_pendubot.urdf")
    for path in sorted(folder.glob("*.parquet")):
        report = check_log(robot, read_log(path))
        assert not report.refused, report.summary()
        assert not names(report) & {"unit_of_position", "unit_of_time", "unit_of_torque"}, report.summary()


def test_simple_pendulum_runs_are_told_apart(data):
    """Two swing-ups pass; an arm that is moved by hand, and a run that rings, are refused with the reason."""
    folder = data("simple_pendulum_dfki")
    robot = load_robot(folder / "simple_pendulum.urdf")
    for run in ("ddp", "dircol"):
        assert not check_log(robot, read_log(folder / f"{run}.parquet")).refused
    by_hand = check_log(robot, read_log(folder / "gravity_comp.parquet"))
    assert names(by_hand, "refuse") == {"moved_by_others"}
    with pytest.raises(NotIdentifiableError, match=r"sysid\.parquet.*badly excited"):
        check_log(robot, read_log(folder / "sysid.parquet")).raise_if_refused()
