"""Descriptions as vendors publish them: what they leave open is unknown, and is no reason to refuse them."""

from __future__ import annotations

import numpy as np
import pytest

from robots.common.errors import AssumedValueWarning, InputError
from robots.loading import load_robot
from robots.robot_summary import robot_data, robot_summary

pytestmark = pytest.mark.filterwarnings(f"ignore::{AssumedValueWarning.__module__}.{AssumedValueWarning.__name__}")

BODY = (
    '<inertial><origin xyz="0 0 0.1"/><mass value="{}"/>'
    '<inertia ixx="0.5" ixy="0" ixz="0" iyy="0.5" iyz="0" izz="0.3"/></inertial>'
)


def arm(bodies=("", "", ""), effort=100):
    """Three links as ros-industrial writes them: no <inertial>, unless given."""
    a, b, c = bodies
    links = f'<link name="base"/><link name="a">{a}</link><link name="b">{b}</link><link name="c">{c}</link>'
    return f"""<robot name="nomass">{links}
<joint name="a1" type="revolute"><parent link="base"/><child link="a"/><origin xyz="0 0 0.4"/><axis xyz="0 0 1"/>
<limit effort="{effort}" lower="-3" upper="3" velocity="2"/></joint>
<joint name="a2" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0.1 0 0.2"/><axis xyz="0 1 0"/>
<limit effort="{effort}" lower="-1.5" upper="1.5" velocity="2"/></joint>
<joint name="a3" type="revolute"><parent link="b"/><child link="c"/><origin xyz="0 0 0.5"/><axis xyz="0 -1 0"/>
<limit effort="{effort}" lower="-1.5" upper="1.5" velocity="2"/></joint></robot>"""


LINKS = """name: nm
urdf: arm.urdf
dynamics:
  links:
    - {mass: 4.0, com: [0.0, 0, 0.1], inertia_at_com: [0.05, 0, 0, 0.06, 0, 0.06]}
    - null
    - {mass: 2.0, com: [0.1, 0, 0], inertia_at_com: [0.004, 0, 0, 0.01, 0, 0.01]}
"""


def test_masses_of_a_urdf_without_inertials_are_unknown(tmp_path):
    """A URDF without <inertial> is read; all inertial parameters are NaN, and a note says what needs them."""
    path = tmp_path / "arm.urdf"
    path.write_text(arm())
    robot = load_robot(path)
    assert np.isnan(robot.inertia).all()
    assert not robot.has_inertia
    assert robot_data(robot)["moved_mass"] is None
    (note,) = [note for note in robot.notes if "masses" in note]
    assert note.startswith("the masses of all links are not stated, so they are unknown")
    assert "unknown mass" in robot_summary(robot)


def test_masses_of_some_links_only(tmp_path):
    """Links with an <inertial> keep it, beside links without: the note names the joints that move these."""
    path = tmp_path / "arm.urdf"
    path.write_text(arm(("", BODY.format(14), "")))
    robot = load_robot(path)
    np.testing.assert_allclose(robot.inertia[1, :4], [14, 0, 0, 1.4])
    assert np.isnan(robot.inertia[[0, 2]]).all()
    assert any(note.startswith("the masses of the links that a1, a3 move are not stated") for note in robot.notes)
    assert not robot.has_inertia


def test_a_yaml_states_masses_for_a_urdf(tmp_path):
    """Links of a YAML replace those of its URDF, in the joint's frame; null leaves them as they are."""
    (tmp_path / "arm.urdf").write_text(arm(("", BODY.format(14), "")))
    (tmp_path / "arm.yaml").write_text(LINKS)
    robot = load_robot(tmp_path / "arm.yaml")
    assert robot.has_inertia
    np.testing.assert_allclose(robot.inertia[:, 0], [4, 14, 2])
    # Steiner: 2 kg at 0.1 m along x add 0.02 kg m2 about y and z.
    np.testing.assert_allclose(robot.inertia[2], [2, 0.2, 0, 0, 0.004, 0, 0, 0.03, 0, 0.03], atol=1e-15)
    assert not any("masses" in note for note in robot.notes)


def test_a_yaml_leaves_masses_unknown(tmp_path):
    """A link of null in a table's dynamics is unknown; the number of links must be that of the joints."""
    table = LINKS.replace(
        "urdf: arm.urdf",
        "geometry: {convention: modified, joints: [{a: 0}, {a: 0.1, alpha: -1.57}, {a: 0.5}]}",
    )
    path = tmp_path / "table.yaml"
    path.write_text(table)
    robot = load_robot(path)
    assert np.isnan(robot.inertia).all(axis=1).tolist() == [False, True, False]
    path.write_text(table.replace("    - null\n", ""))
    with pytest.raises(InputError, match=r"dynamics\.links: 2 links; allowed: 3, one per joint; null where unknown"):
        load_robot(path)


def test_an_effort_of_zero_is_unknown(tmp_path):
    """effort="0" limits nothing, and a note says that it stands for unknown."""
    path = tmp_path / "arm.urdf"
    path.write_text(arm([BODY.format(5)] * 3, effort=0))
    robot = load_robot(path)
    np.testing.assert_array_equal(robot.limits.torque, [np.inf] * 3)
    assert "joints a1, a2, a3: <limit> has effort 0, which stands for unknown" in robot.notes
    assert any("no torque limits" in note for note in robot.notes)


def test_a_torque_limit_of_zero_in_a_yaml_is_refused(tmp_path):
    """A robot YAML, which people write, has .inf for unknown: a torque limit of 0 names the key and the joint."""
    (tmp_path / "arm.urdf").write_text(arm())
    path = tmp_path / "arm.yaml"
    path.write_text("name: a\nurdf: arm.urdf\nlimits: {torque: {values: [10, 0, 5], unit: N m}}\n")
    with pytest.raises(InputError, match=r"limits\.torque, joint 2: found 0; allowed: above zero, or inf where unk"):
        load_robot(path)
