"""Boxes about links, from the primitive shapes of a URDF."""

import numpy as np
import pytest

from robots.collision.drawn.link_boxes import link_boxes
from robots.loading import load_robot

URDF = """<robot name="r">
  <link name="base"/>
  <link name="a">
    <inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    {shape_a}
  </link>
  <link name="b">
    <inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <visual><geometry><sphere radius="0.2"/></geometry></visual>
    <collision><origin xyz="0 0 0.5" rpy="1.5707963267948966 0 0"/>
      <geometry><cylinder radius="0.1" length="0.6"/></geometry></collision>
  </link>
  <link name="tool">
    <inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <collision><geometry><sphere radius="0.05"/></geometry></collision>
  </link>
  <joint name="j1" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
  <joint name="j2" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
  <joint name="fix" type="{fixed}"><parent link="b"/><child link="tool"/><origin xyz="0 0 1"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
</robot>"""
BOX = '<collision><origin xyz="0.1 0 0"/><geometry><box size="0.2 0.4 0.6"/></geometry></collision>'
MESH = '<collision><geometry><mesh filename="a.stl"/></geometry></collision>'


def boxes_of(tmp_path, shape_a=BOX, fixed="fixed", **options):
    path = tmp_path / "r.urdf"
    path.write_text(URDF.format(shape_a=shape_a, fixed=fixed))
    return link_boxes(load_robot(path, **options))


def test_shapes_and_what_is_fixed_to_them_make_the_box(tmp_path):
    """Boxes, turned cylinders and a tool's sphere, collision before visual, in the link's own frame."""
    boxes = boxes_of(tmp_path)
    np.testing.assert_allclose(boxes[1], [[0.0, -0.2, -0.3], [0.2, 0.2, 0.3]], atol=1e-12)
    np.testing.assert_allclose(boxes[2], [[-0.1, -0.3, 0.4], [0.1, 0.3, 1.05]], atol=1e-12)


@pytest.mark.parametrize("shape", [MESH, "", '<collision><geometry><box size="1 2"/></geometry></collision>'])
def test_a_link_whose_extent_is_not_known_gets_none(tmp_path, shape):
    """A mesh, no shape at all, or one that cannot be read: no box, and the other links keep theirs."""
    boxes = boxes_of(tmp_path, shape_a=shape)
    assert set(boxes) == {2}


def test_a_branch_behind_a_locked_joint_makes_the_extent_unknown(tmp_path):
    """The pose of a locked joint's branch is not known here."""
    assert set(boxes_of(tmp_path, fixed="revolute", joints=["j1", "j2"])) == {1}


def test_robots_of_other_files_have_none():
    """A robot that is not read from a URDF of its own has no boxes."""
    assert link_boxes(load_robot("er3a")) == {}
