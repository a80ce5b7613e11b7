"""Reading URDF files: what they mean, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from robots.common.errors import InputError
from robots.geometry.urdf import read_urdf

BODY = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
LIMIT = '<limit lower="-1" upper="1" velocity="2" effort="3"/>'


def link(name, body=BODY):
    return f'<link name="{name}">{body}</link>'


def joint(name, parent, child, kind="revolute", inside=LIMIT):
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{inside}</joint>'


ARM = link("base") + link("l1") + joint("j1", "base", "l1")


def test_limits_come_from_the_file(write_urdf):
    """Position, velocity and effort limits are the file's; acceleration and jerk, not stated there, are infinite."""
    limits = read_urdf(write_urdf(ARM)).chain().limits
    assert (limits.lower[0], limits.upper[0], limits.velocity[0], limits.torque[0]) == (-1.0, 1.0, 2.0, 3.0)
    assert np.isinf(limits.acceleration[0])
    assert np.isinf(limits.jerk[0])


def test_a_continuous_joint_has_no_position_limits(write_urdf):
    """A continuous joint turns without end; its velocity and effort are unlimited unless stated."""
    body = ARM + link("l2") + joint("j2", "l1", "l2", "continuous", "")
    body += link("l3") + joint("j3", "l2", "l3", "continuous", '<limit velocity="4" effort="5"/>')
    limits = read_urdf(write_urdf(body)).chain().limits
    np.testing.assert_array_equal(limits.upper, [1.0, np.inf, np.inf])
    np.testing.assert_array_equal(limits.velocity, [2.0, np.inf, 4.0])
    np.testing.assert_array_equal(limits.torque, [3.0, np.inf, 5.0])


def test_limits_of_zero_are_unknown(write_urdf):
    """Exporters write zero for what they do not know: no range, and no limit of velocity and torque."""
    inside = '<limit lower="0" upper="0" velocity="0" effort="0"/>'
    taken = read_urdf(write_urdf(link("base") + link("l1") + joint("j1", "base", "l1", inside=inside))).chain()
    assert (taken.limits.lower[0], taken.limits.upper[0]) == (-np.inf, np.inf)
    assert taken.unlimited == ("j1",)
    assert (taken.limits.velocity[0], taken.limits.torque[0]) == (np.inf, np.inf)
    assert taken.notes[0] == "joint j1: <limit> has velocity and effort 0, which stands for unknown"


@pytest.mark.parametrize("inside", ["", '<limit lower="0.3" upper="0.3"/>'])
def test_limits_that_are_missing_or_equal_are_unknown(inside, write_urdf):
    """A joint without <limit>, or with two equal ends, has no known limits; a note names ends other than zero."""
    taken = read_urdf(write_urdf(link("base") + link("l1") + joint("j1", "base", "l1", inside=inside))).chain()
    assert (taken.limits.lower[0], taken.limits.upper[0]) == (-np.inf, np.inf)
    assert (taken.limits.velocity[0], taken.limits.torque[0]) == (np.inf, np.inf)
    assert taken.unlimited == ("j1",)
    named = "joint j1: <limit> has lower and upper 0.3, which stands for unknown" in taken.notes
    assert named == bool(inside)


def test_links_without_a_mass_are_unknown(write_urdf):
    """A body whose links state no mass, or zero, has a row of NaN; what is fixed to it counts where it has one."""
    weightless = BODY.replace('mass value="1"', 'mass value="0"').replace("1", "0")
    body = link("base") + link("l1", "") + joint("j1", "base", "l1") + link("l2", weightless) + joint("j2", "l1", "l2")
    body += link("l3", "") + joint("j3", "l2", "l3") + link("tool") + joint("fixed", "l3", "tool", "fixed", "")
    taken = read_urdf(write_urdf(body)).chain()
    assert np.isnan(taken.inertia[:2]).all()
    np.testing.assert_array_equal(taken.inertia[2], [1, 0, 0, 0, 1, 0, 0, 1, 0, 1])


def test_a_body_without_one_half_of_its_inertial(write_urdf):
    """A mass without <inertia> is a point mass; an <inertia> without <mass> is no body, which a note says."""
    camera = '<inertial><origin xyz="0 0 0.5"/><mass value="2"/></inertial>'
    body = ARM + link("camera", camera) + joint("f", "l1", "camera", "fixed", "")
    np.testing.assert_array_equal(read_urdf(write_urdf(body)).chain().inertia[0], [3, 0, 0, 1, 1.5, 0, 0, 1.5, 0, 1])
    taken = read_urdf(write_urdf(ARM.replace('<mass value="1"/>', ""))).chain()
    assert np.isnan(taken.inertia).all()
    assert taken.notes == ("link l1 has an inertia but no mass: it is not used",)


def test_a_finger_that_mimics_an_unknown_joint_is_locked(write_urdf):
    """A joint beside the chain whose leader does not exist is held at its offset, and a note says so."""
    other = joint("f2", "l1", "b", "prismatic", f'<axis xyz="0 1 0"/><mimic joint="j9" offset="0.25"/>{LIMIT}')
    taken = read_urdf(write_urdf(ARM + link("b") + other)).chain(joints=["j1"])
    assert taken.inertia[0, 2] == pytest.approx(0.25, abs=1e-15)
    assert "joint f2 mimics the unknown joint j9; it is treated as locked" in taken.notes


@pytest.mark.parametrize(("count", "named"), [(3, False), (4, True)])
def test_equal_masses_of_all_links_are_doubted(count, named, write_urdf):
    """Four links or more of one mass, as exporters fill them in, have a note; the masses count all the same."""
    body = link("l0") + "".join(link(f"l{i}") + joint(f"j{i}", f"l{i - 1}", f"l{i}") for i in range(1, count + 1))
    taken = read_urdf(write_urdf(body)).chain()
    note = f"all {count} links with a mass have 1 kg: it may stand for unknown masses"
    assert (note in taken.notes) == named
    np.testing.assert_array_equal(taken.inertia[:, 0], np.ones(count))


def test_undeclared_prefixes_are_read_past(write_urdf):
    """Elements with a prefix that is nowhere declared, which ROS accepts, are not used; the arm is read."""
    plain = read_urdf(write_urdf(ARM)).chain()
    drake = "<drake:declare_convex/><ros:control><ros:joint name='j1'/></ros:control>"
    taken = read_urdf(write_urdf(ARM.replace("<limit ", '<limit drake:acceleration="2" ') + drake))
    np.testing.assert_array_equal(taken.chain().inertia, plain.inertia)
    assert any("drake" in part for part in taken.unused)


def test_an_inertia_without_mass_is_left_out_with_a_note(write_urdf):
    """A tool frame of 1e-6 kg m2 without mass, as simulators demand one, is no body: a note says so."""
    frame = '<inertial><mass value="0"/><inertia ixx="1e-6" ixy="0" ixz="0" iyy="1e-6" iyz="0" izz="1e-6"/></inertial>'
    taken = read_urdf(write_urdf(ARM + link("tool0", frame) + joint("flange", "l1", "tool0", "fixed", ""))).chain()
    np.testing.assert_array_equal(taken.inertia[0], [1, 0, 0, 0, 1, 0, 0, 1, 0, 1])
    assert "link tool0 has an inertia but no mass: it is not used" in taken.notes


def test_the_axis_is_x_unless_stated(write_urdf):
    """A joint without <axis> turns about x, as URDF defines it; a stated axis is normalised."""
    body = ARM + link("l2") + joint("j2", "l1", "l2", inside=LIMIT + '<axis xyz="0 3 4"/>')
    axes = [joint.axis for joint in read_urdf(write_urdf(body)).chain().chain.joints]
    np.testing.assert_allclose(axes, [[1, 0, 0], [0, 0.6, 0.8]], atol=1e-16)


def test_friction_comes_from_the_file(write_urdf):
    """<dynamics> states Coulomb friction f1 and damping f2."""
    inside = LIMIT + '<dynamics damping="0.5" friction="0.25"/>'
    tree = read_urdf(write_urdf(link("base") + link("l1") + joint("j1", "base", "l1", inside=inside)))
    np.testing.assert_array_equal(tree.friction(["j1"]), [[0.25, 0.5, 0.0, 0.0]])


def test_the_world_need_not_be_declared(write_urdf):
    """A parent link "world" that is not declared is taken as the root."""
    tree = read_urdf(write_urdf(joint("weld", "world", "base", "fixed", "") + ARM))
    assert tree.root == "world"
    assert tree.chain().names == ("j1",)


def test_massless_frames_merge(write_urdf):
    """Links without inertia, or of zero mass, merge into the body they are fixed to."""
    zero = BODY.replace('"1"', '"0"')
    body = ARM + link("tool", zero) + joint("f", "l1", "tool", "fixed", "") + link("tcp", "")
    body += joint("g", "tool", "tcp", "fixed", '<origin xyz="0 0 0.5"/>')
    taken = read_urdf(write_urdf(body)).chain()
    assert taken.inertia[0, 0] == 1.0
    assert taken.chain.flange([0.0])[2, 3] == 0.5


def test_a_bad_body_of_the_base_does_no_harm(write_urdf):
    """An impossible inertia of a link that never moves is of no consequence."""
    bad = BODY.replace('ixx="1"', 'ixx="-1"')
    assert read_urdf(write_urdf(link("base", bad) + link("l1") + joint("j1", "base", "l1"))).chain().names == ("j1",)


def test_other_elements_are_left_alone(write_urdf):
    """Meshes, transmissions, simulator settings and a name space declared but unused do not matter."""
    body = ARM + '<transmission name="t"><joint name="j1"/></transmission>'
    body += '<gazebo xmlns:xacro="http://www.ros.org/wiki/xacro"><plugin filename="${none}"/></gazebo>'
    assert read_urdf(write_urdf(body)).chain().names == ("j1",)


def test_a_mimic_joint_beside_the_chain_follows_its_leader(write_urdf):
    """A joint that mimics a locked one stands at multiplier times the leader's position plus the offset."""
    finger = joint("f1", "l1", "a", "prismatic", '<axis xyz="0 1 0"/>' + LIMIT)
    other = joint(
        "f2", "l1", "b", "prismatic", f'<axis xyz="0 1 0"/><mimic joint="f1" multiplier="-2" offset="0.1"/>{LIMIT}'
    )
    path = write_urdf(ARM + link("a") + link("b") + finger + other)
    taken = read_urdf(path).chain(joints=["j1"], locked={"f1": 0.2})
    # mPy: 1 kg at 0.2 m and 1 kg at -2 * 0.2 + 0.1 m
    assert taken.inertia[0, 2] == pytest.approx(0.2 - 0.3, abs=1e-15)


def test_a_mimic_joint_of_a_moving_leader_is_locked_and_said_so(write_urdf):
    """A side joint that mimics a moving joint is taken as locked, and a note says so."""
    other = joint("f2", "base", "b", "revolute", f'<mimic joint="j1" offset="0.1"/>{LIMIT}')
    path = write_urdf(ARM + link("b") + other)
    notes = read_urdf(path).chain(joints=["j1"]).notes
    assert notes[-1] == "joint f2 mimics the moving joint j1; it is treated as locked"


def test_mimicry_in_a_circle_is_refused(write_urdf):
    """Joints that mimic each other have no position."""
    first = joint("f1", "l1", "a", inside=f'<mimic joint="f2"/>{LIMIT}')
    second = joint("f2", "l1", "b", inside=f'<mimic joint="f1"/>{LIMIT}')
    tree = read_urdf(write_urdf(ARM + link("a") + link("b") + first + second))
    with pytest.raises(InputError, match="mimics itself"):
        tree.chain(joints=["j1"])


WRONG = {
    "no joint": (link("base"), "the URDF has no joint"),
    "no moving joint": (link("a") + link("b") + joint("f", "a", "b", "fixed", ""), "no joint moves"),
    "two parents": (
        ARM + link("l2") + joint("j2", "base", "l2") + joint("j3", "l1", "l2"),
        "link 'l2' has two parents",
    ),
    "loop": (
        ARM + link("a") + link("b") + joint("ja", "a", "b") + joint("jb", "b", "a"),
        "link 'a' is part of a loop",
    ),
    "all one loop": (link("a") + link("b") + joint("ja", "a", "b") + joint("jb", "b", "a"), "part of a loop"),
    "two roots": (ARM + link("lost"), "2 links have no parent: 'base', 'lost'"),
    "unknown parent": (ARM + link("l2") + joint("j2", "l3", "l2"), "joint j2: the parent link 'l3' does not exist"),
    "unknown child": (ARM + joint("j2", "l1", "l2"), "joint j2: the child link 'l2' does not exist"),
    "same link": (ARM + link("l1"), "two links have the name 'l1'"),
    "same joint": (ARM + link("l2") + joint("j1", "l1", "l2"), "two joints have the name 'j1'"),
    "no link name": ("<link/>", "a <link> has no name"),
    "no joint name": (link("a") + '<joint type="fixed"/>', "a <joint> has no name"),
    "no parent": (link("a") + '<joint name="j" type="fixed"/>', "joint j: <parent link=...> is missing"),
    "floating": (link("a") + link("b") + joint("j", "a", "b", "floating"), "joint j: a floating joint moves in more"),
    "planar": (link("a") + link("b") + joint("j", "a", "b", "planar"), "joint j: a planar joint moves in more"),
    "screw": (link("a") + link("b") + joint("j", "a", "b", "screw"), "joint j: unknown joint type 'screw'"),
    "zero axis": (
        link("a") + link("b") + joint("j", "a", "b", inside=LIMIT + '<axis xyz="0 0 0"/>'),
        "joint j: the axis has no length",
    ),
    "axis of two": (
        link("a") + link("b") + joint("j", "a", "b", inside=LIMIT + '<axis xyz="0 1"/>'),
        "joint j: <axis> xyz is '0 1'; allowed: 3 finite",
    ),
    "not a number": (
        link("a") + link("b") + joint("j", "a", "b", inside=LIMIT + '<origin xyz="0 0 x"/>'),
        "joint j: <origin> xyz is '0 0 x'; allowed: 3 number",
    ),
    "nan": (
        link("a") + link("b") + joint("j", "a", "b", inside=LIMIT + '<origin xyz="0 0 nan"/>'),
        "joint j: <origin> xyz is '0 0 nan'",
    ),
    "negative velocity": (
        link("a") + link("b") + joint("j", "a", "b", inside='<limit velocity="-1" effort="1"/>'),
        "joint j: <limit> velocity is -1; allowed: zero or more",
    ),
    "limits reversed": (
        link("a") + link("b") + joint("j", "a", "b", inside='<limit lower="1" upper="-1" velocity="1" effort="1"/>'),
        "joint j: <limit> has lower 1 and upper -1",
    ),
    "negative mass": (
        ARM.replace('<link name="l1">' + BODY, link("l1", BODY.replace('mass value="1"', 'mass value="-1"'))[:-7]),
        "link 'l1': a mass of -1 kg",
    ),
    "indefinite": (
        link("a") + link("b", BODY.replace('ixx="1"', 'ixx="-1"')) + joint("j", "a", "b"),
        "link 'b' has an inertia with a negative principal moment of -1",
    ),
    "no izz": (
        link("a") + link("b", BODY.replace('izz="1"', "")) + joint("j", "a", "b"),
        "link 'b': <inertia> izz is missing",
    ),
    "macro": (
        '<xacro:arm xmlns:xacro="http://www.ros.org/wiki/xacro"/>',
        "xacro macros; expand it first",
    ),
    "macro, undeclared": ("<xacro:arm/>", "row 3: the file holds xacro macros; expand it first"),
    "expression": (ARM.replace('value="1"', 'value="${m}"'), "xacro macros; expand it first"),
    "broken": (link("a") + "\n<link>", "row 5: not well-formed XML"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_urdf_is_refused(case, write_urdf):
    """A URDF that cannot be used is refused with its file and its line, link or joint."""
    body, message = WRONG[case]
    path = write_urdf(body)
    with pytest.raises(InputError, match=message) as caught:
        read_urdf(path).chain()
    assert caught.value.file == str(path)


def test_files_that_are_no_urdf_are_refused(tmp_path):
    """A missing file, an empty one and another kind of XML are refused by name."""
    with pytest.raises(InputError, match=r"none\.urdf: no such file"):
        read_urdf(tmp_path / "none.urdf")
    (tmp_path / "empty.urdf").write_text("")
    with pytest.raises(InputError, match=r"empty\.urdf: row 1: not well-formed XML"):
        read_urdf(tmp_path / "empty.urdf")
    (tmp_path / "other.urdf").write_text("<sdf/>")
    with pytest.raises(InputError, match="the root element is <sdf>; allowed: <robot>"):
        read_urdf(tmp_path / "other.urdf")
