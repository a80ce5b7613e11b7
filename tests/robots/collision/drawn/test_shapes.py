"""Drawn shapes that meet, by closed forms, and the pairs that they judge."""

from __future__ import annotations

import numpy as np
import pytest

from robots.collision import check_motion, collision_model
from robots.collision.drawn.shapes import DrawnBodies, shapes_of
from robots.collision.pairs import poses_of
from robots.loading import load_robot
from robots.signals import Motion

BODY = '<inertial><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>'
LIMIT = '<limit lower="-3.1" upper="3.1" velocity="1" effort="1"/>'


def planar(tmp_path, *, tag="collision", second=""):
    """A base and two links in a plane, 0.3 m long each, with a ball of 0.1 m at the base and one at the tip."""

    def ball(radius, x):
        return f'<{tag}><origin xyz="{x} 0 0"/><geometry><sphere radius="{radius}"/></geometry></{tag}>'

    text = f'<robot name="planar"><link name="base">{ball(0.1, 0)}</link><link name="one">{BODY}{second}</link>'
    text += f'<link name="two">{BODY}{ball(0.05, 0.3)}</link>'
    for name, parent, child, x in (("j1", "base", "one", 0.0), ("j2", "one", "two", 0.3)):
        text += f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
        text += f'<origin xyz="{x} 0 0"/><axis xyz="0 0 1"/>{LIMIT}</joint>'
    path = tmp_path / "planar.urdf"
    path.write_text(text + "</robot>")
    return path


@pytest.mark.parametrize("tag", ["collision", "visual"])
def test_balls_meet_where_their_centres_are_near(tmp_path, tag):
    """Two balls meet where their distance, of the isosceles triangle 0.6 sin(angle / 2), is below their radii's sum."""
    robot = load_robot(planar(tmp_path, tag=tag))
    bodies = DrawnBodies(shapes_of(robot), robot.urdf)
    assert set(bodies.bodies) == {0, 2}
    q = np.column_stack([np.full(60, 0.7), np.linspace(2.0, 3.1, 60)])
    apart = 0.6 * np.cos(q[:, 1] / 2.0)
    assert (apart < 0.15).any()
    assert (apart > 0.15).any()
    met = bodies.meet(frozenset((0, 2)), poses_of(robot.chain, q))
    np.testing.assert_array_equal(met, apart < 0.15)


def test_neighbours_that_meet_are_found_by_their_shapes(tmp_path):
    """A box on the second link turns into one on the first: no capsule watches neighbours, the shapes find it."""
    box = '<collision><origin xyz="0.1 0.1 0"/><geometry><box size="0.1 0.05 0.02"/></geometry></collision>'
    path = planar(tmp_path, second=box)
    text = (
        path.read_text()
        .replace('<origin xyz="0.3 0 0"/><geometry><sphere radius="0.05"/>', "{}")
        .format('<origin xyz="0.15 0 0"/><geometry><box size="0.3 0.02 0.02"/>')
    )
    path.write_text(text)
    model = collision_model(load_robot(path), floor=False)
    assert frozenset((1, 2)) in model.by_shape
    t = np.linspace(0.0, 4.0, 401)
    q = np.column_stack([np.zeros(401), -0.65 * t])  # the box is met at 2.45 rad
    turn = np.column_stack([np.zeros(401), np.full(401, -0.65)])
    for sign, expected in ((1.0, ()), (-1.0, ("link 1 / link 2",))):
        report = check_motion(model, Motion(t, sign * q, sign * turn, np.zeros((401, 2))), confirm=False)
        assert tuple(name for name, _ in report.meetings) == expected
        assert report.collides == bool(expected)
        assert report.certified == (not expected)
