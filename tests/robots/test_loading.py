"""Loading robots by name, from URDF files and from YAML files."""

from __future__ import annotations

import hashlib
import pickle
import warnings

import numpy as np
import pytest

from robots import loading
from robots.common.errors import AssumedValueWarning, InputError
from robots.geometry.dh import DhRow, chain_from_dh
from robots.loading import load_robot
from tests.robots.robot_files import TABLE

pytestmark = pytest.mark.filterwarnings(f"ignore::{AssumedValueWarning.__module__}.{AssumedValueWarning.__name__}")


def test_a_table_becomes_a_robot(write):
    """A Denavit-Hartenberg file gives geometry, limits and dynamics in SI units at the joint."""
    path = write(TABLE)
    robot = load_robot(path)
    expected = chain_from_dh(
        [DhRow(alpha=np.pi / 2, a=0.5, d=0.1), DhRow(kind="prismatic", d=0.2, offset=np.pi / 2)], "standard"
    )
    np.testing.assert_allclose(robot.chain.flange([0.3, 0.1]), expected.flange([0.3, 0.1]), atol=1e-16)
    np.testing.assert_allclose(robot.limits.upper, [np.pi / 2, 0.1], rtol=1e-15)
    np.testing.assert_allclose(robot.limits.velocity, [np.pi, np.inf], rtol=1e-15)
    assert np.isinf(robot.limits.jerk).all()
    np.testing.assert_allclose(robot.rotor_inertia, [0.1, 0.008], rtol=1e-14)
    np.testing.assert_allclose(robot.torque_constant, [10.0, 4.0], rtol=1e-14)
    np.testing.assert_array_equal(robot.friction, [[1, 0, 0, 3], [2, 0, 0, 4]])
    assert (robot.name, robot.origin, robot.period, robot.assumed) == ("pair", str(path), 0.004, ())


def test_dynamics_of_a_standard_table_are_given_in_its_frames(write):
    """In the standard convention a link's entry, given in frame i, is moved to the frame on the joint's own axis."""
    inertia = load_robot(write(TABLE)).inertia
    # Frame 1 lies 0.5 m out and 0.1 m up, turned by 90 deg about x: its y is our z. Its com -0.25 m is our +0.25 m.
    mass, c = 2.0, np.array([0.25, 0.0, 0.1])
    about = np.diag([0.01, 0.03, 0.02]) + mass * (c @ c * np.eye(3) - np.outer(c, c))
    expected = [mass, *(mass * c), *about[np.triu_indices(3)]]
    np.testing.assert_allclose(inertia[0], expected, atol=1e-15)


def test_dynamics_may_be_unknown(write):
    """Without dynamics, inertia and torque constants are NaN, rotor inertia and friction zero, gear ratios one."""
    robot = load_robot(write(TABLE[: TABLE.index("dynamics")]))
    assert np.isnan(robot.inertia).all()
    assert not robot.has_inertia
    assert np.isnan(robot.torque_constant).all()
    assert not robot.rotor_inertia.any()
    assert not robot.friction.any()
    np.testing.assert_array_equal(robot.gear_ratio, [1.0, 1.0])


def test_base_flange_and_gravity_of_a_table(write):
    """Base and flange poses and gravity may be stated."""
    extra = "base: {xyz: [0, 0, 1]}\nflange: {xyz: [0, 0, 0.5]}\ngravity: [0, 9.81, 0]\n"
    plain, robot = load_robot(write(TABLE)), load_robot(write(TABLE + extra))
    shift = robot.chain.flange([0, 0])[:3, 3] - plain.chain.flange([0, 0])[:3, 3]
    # the last z axis is -y of the base
    np.testing.assert_allclose(shift, [0.0, -0.5, 1.0], atol=1e-15)
    np.testing.assert_array_equal(robot.chain.gravity, [0.0, 9.81, 0.0])


def test_a_urdf_becomes_a_robot(urdf):
    """A URDF gives a robot of its name, whose digest is the file's."""
    robot = load_robot(str(urdf))
    assert (robot.name, robot.origin, robot.joint_names) == ("two", str(urdf), ("j1", "j2"))
    np.testing.assert_array_equal(robot.friction[0], [0.25, 0.5, 0.0, 0.0])
    np.testing.assert_array_equal(robot.limits.torque, [3.0, 30.0])
    assert robot.assumed == ()
    assert robot.digest == hashlib.sha256(urdf.read_bytes()).hexdigest()


def test_the_choice_of_joints_is_part_of_the_digest(urdf):
    """The same file with other joints is another robot."""
    digests = {
        load_robot(urdf).digest,
        load_robot(urdf, joints=["j1"]).digest,
        load_robot(urdf, locked={"j2": 0.0}).digest,
        load_robot(urdf, locked={"j2": 0.05}).digest,
        load_robot(urdf, tip="l1").digest,
    }
    assert len(digests) == 5
    assert load_robot(urdf, locked={"j2": 0}).digest in digests
    assert load_robot(urdf, joints=("j1",)).digest == load_robot(urdf, joints=["j1"]).digest


def test_a_yaml_may_add_to_a_urdf(urdf, write):
    """A YAML file that names a URDF adds limits and drives to it, and overrides what it states."""
    text = (
        "name: added\nurdf: two.urdf\nlimits:\n  acceleration: {values: [5, 6], unit: [rad/s2, m/s2],"
        " source: assumed}\n"
        "  velocity: {values: [1, .1], unit: [rad/s, m/s]}\ndynamics:\n  drives: {gear_ratio: {values: [50, 60]}}\n"
        "  friction: {coulomb: {values: [7, 8]}}\ngravity: [0, 0, 0]\n"
    )
    robot = load_robot(write(text))
    np.testing.assert_array_equal(robot.limits.acceleration, [5.0, 6.0])
    np.testing.assert_array_equal(robot.limits.velocity, [1.0, 0.1])
    np.testing.assert_array_equal(robot.limits.upper, [1.0, 0.1])
    np.testing.assert_array_equal(robot.friction, [[7, 0.5, 0, 0], [8, 0, 0, 0]])
    np.testing.assert_array_equal(robot.gear_ratio, [50.0, 60.0])
    np.testing.assert_array_equal(robot.chain.gravity, [0.0, 0.0, 0.0])
    assert robot.assumed == ("limits.acceleration",)


def test_a_choice_overrides_that_of_the_yaml():
    """Joints may be locked in a catalogue robot; its lists stay with the joints they were written for."""
    whole = load_robot("panda")
    part = load_robot("panda", locked={"panda_joint3": 0.1})
    assert part.joint_names == tuple(name for name in whole.joint_names if name != "panda_joint3")
    np.testing.assert_array_equal(part.limits.jerk, np.delete(whole.limits.jerk, 2))
    assert part.digest != whole.digest
    fingered = load_robot("panda", tip="panda_leftfinger", locked={"panda_joint1": 0.0}, joints=["panda_finger_joint1"])
    assert fingered.joint_names == ("panda_finger_joint1",)
    np.testing.assert_array_equal(fingered.limits.jerk, [np.inf])
    assert fingered.stated == "panda --tip panda_leftfinger --joints panda_finger_joint1 --lock panda_joint1=0"
    wrist = load_robot("panda", tip="panda_link3")
    np.testing.assert_array_equal(wrist.limits.acceleration, whole.limits.acceleration[:3])


def test_a_robot_is_returned_as_it_is(urdf):
    """A robot loaded already is returned; a choice of joints then comes too late."""
    robot = load_robot(urdf)
    assert load_robot(robot) is robot
    with pytest.raises(InputError, match="two is loaded already"):
        load_robot(robot, tip="l1")


def test_a_robot_crosses_process_borders(urdf):
    """A robot pickles."""
    robot = load_robot(urdf)
    copy = pickle.loads(pickle.dumps(robot))
    np.testing.assert_array_equal(copy.inertia, robot.inertia)
    np.testing.assert_array_equal(copy.chain.flange([0.1, 0.2]), robot.chain.flange([0.1, 0.2]))


def test_assumed_values_are_reported_once(write, monkeypatch):
    """A robot with values that no source backs warns in one line the first time it is loaded, and then no more."""
    monkeypatch.setattr(loading, "_warned", set())
    path = write(TABLE.replace("cubic: {values: [3, 4]}", "cubic: {values: [3, 4], source: assumed}"))
    with pytest.warns(AssumedValueWarning, match=r"^pair: .*assumptions.*: dynamics\.friction\.cubic$") as caught:
        load_robot(path)
    assert sum("assumptions" in str(one.message) for one in caught) == 1
    assert caught[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load_robot(path)


@pytest.mark.parametrize("kind", ["table", "urdf"])
def test_limits_that_a_yaml_lacks_are_said_to_be_assumed(urdf, write, monkeypatch, kind):
    """Accelerations and jerks that neither the YAML nor its file states are listed, and stated ones are not."""
    monkeypatch.setattr(loading, "_warned", set())
    text = TABLE if kind == "table" else "name: pair\nurdf: two.urdf\n"
    # 180 deg/s and 2 rad/s of the first joints in 0.25 s; the table's second joint has no speed limit.
    values = {"table": "12.6 rad/s2", "urdf": "8 rad/s2, 0.8 m/s2"}[kind]
    with pytest.warns(AssumedValueWarning, match=f"^pair: assumed, .* acceleration limits {values} .*jerk limits"):
        load_robot(write(text))
    stated = "acceleration: {values: 5, unit: [rad/s2, m/s2]}\n  jerk: {values: 50, unit: [rad/s3, m/s3]}"
    text = text.replace("limits:\n", f"limits:\n  {stated}\n") if kind == "table" else f"{text}limits:\n  {stated}\n"
    assert not [note for note in load_robot(write(text)).notes if "assumed" in note]


def test_motor_speed_and_rms_torque(tmp_path):
    """A motor's speed, in its own unit and before the gear, lowers the joint's velocity limit; RMS torque is read."""
    text = """
name: geared
geometry:
  convention: modified
  joints: [{alpha: 0.0, a: 0.0, d: 0.1}, {alpha: 1.5, a: 0.2, d: 0.0}]
limits:
  velocity: {values: [3.0, 3.0], unit: rad/s}
  torque_rms: {values: [20.0, .inf], unit: N m}
dynamics:
  drives:
    gear_ratio: {values: [-100.0, 50.0]}
    motor_speed: {values: [1200.0, 3000.0], unit: rpm}
"""
    (tmp_path / "geared.yaml").write_text(text)
    robot = load_robot(str(tmp_path / "geared.yaml"))
    # 1200 turns a minute are 125.66 rad/s; the second motor would reach 6.3 rad/s at the joint, more than it may.
    np.testing.assert_allclose(robot.limits.velocity, [1.2566370614, 3.0], rtol=1e-9)
    np.testing.assert_allclose(robot.motor_speed, np.array([1200, 3000]) * 2 * np.pi / 60, rtol=1e-12)
    np.testing.assert_array_equal(robot.limits.torque_rms, [20.0, np.inf])
    assert robot.limits.scaled(torque=0.5).torque_rms[0] == 10.0
    without = text.replace("    gear_ratio: {values: [-100.0, 50.0]}\n", "")
    (tmp_path / "geared.yaml").write_text(without)
    with pytest.raises(InputError, match=r"motor_speed refers to the motor, but the gear_ratio .* is missing"):
        load_robot(str(tmp_path / "geared.yaml"))


def test_one_value_holds_for_all_joints(tmp_path):
    """A number without brackets is the value of every joint; a list of one is still a list of the wrong length."""
    text = TABLE.replace("values: [180, .inf], unit: [deg/s, m/s]", "values: 2.5, unit: [rad/s, m/s]")
    text = text.replace("lower: [-90, -100]", "lower: -50").replace("coulomb: {values: [1, 2]}", "coulomb: {values: 7}")
    text = text.replace("gear_ratio: {values: [100, 20]}", "gear_ratio: {values: 50}")
    path = tmp_path / "pair.yaml"
    path.write_text(text)
    robot = load_robot(path)
    np.testing.assert_array_equal(robot.limits.velocity, [2.5, 2.5])
    np.testing.assert_allclose(robot.limits.lower, [np.deg2rad(-50), -0.05], rtol=1e-15)
    np.testing.assert_array_equal(robot.friction[:, 0], [7, 7])
    np.testing.assert_array_equal(robot.gear_ratio, [50, 50])
    path.write_text(text.replace("values: 2.5", "values: [2.5]"))
    with pytest.raises(InputError, match=r"1 values; allowed: 2, one per joint"):
        load_robot(path)
    for wrong in ("yes", "true", ".nan", "{}"):
        path.write_text(text.replace("values: 7", f"values: {wrong}"))
        with pytest.raises(InputError, match=r"dynamics\.friction\.coulomb\.values"):
            load_robot(path)
