"""The plane that an arm is mounted on."""

from __future__ import annotations

import numpy as np
import pytest

from robots.collision import Surroundings, collision_model
from robots.collision.boxes import Box, Scene, floor
from robots.collision.loading import base_plane
from robots.common.errors import InputError
from robots.geometry.chain import Chain, Joint, rotation_from_rpy
from robots.loading import load_robot


def standing(turn=(0.0, 0.0, 0.0)):
    """A vertical axis 0.2 m above the origin, then a horizontal one with a link of 0.5 m; the base is turned."""
    rotation = rotation_from_rpy(turn)
    first = Joint("a", "revolute", rotation, rotation @ [0.0, 0.0, 0.2])
    second = Joint("b", "revolute", rotation_from_rpy((np.pi / 2, 0.0, 0.0)), np.array([0.0, 0.0, 0.3]))
    tip = np.eye(4)
    tip[0, 3] = 0.5
    return Chain((first, second), tip=tip)


def test_an_arm_stands_on_the_origin_of_its_base(limits):
    """Without shapes the plane is that of the base's origin, free above; with a span it is the lowest point."""
    plane = base_plane(standing(), limits(2))
    assert plane.name == "floor"
    np.testing.assert_allclose(plane.normal, [0.0, 0.0, 1.0])
    assert plane.offset == 0.0
    assert base_plane(standing(), limits(2), (-0.1, 0.2)).offset == pytest.approx(-0.1)


def test_a_hanging_arm_keeps_below_its_ceiling(limits):
    """An arm turned upside down has its free side below, and its plane at the highest point of the base."""
    plane = base_plane(standing((np.pi, 0.0, 0.0)), limits(2), (-0.2, 0.05))
    np.testing.assert_allclose(plane.normal, [0.0, 0.0, -1.0])
    assert plane.offset == pytest.approx(-0.05)  # free where -z >= -0.05


def test_a_tilted_first_axis_has_no_plane(limits):
    """Where the first axis is not along z of the base frame, nothing says what the robot is mounted on."""
    assert base_plane(standing((np.pi / 4, 0.0, 0.0)), limits(2)) is None


@pytest.mark.parametrize("name", ["er3a", "ur10", "panda"])
def test_robots_of_the_catalogue_stand_on_a_floor(name):
    """By default the floor is at the base; a height, none, and an own floor of a scene go before."""
    robot = load_robot(name)

    def heights(**options):
        return [o.offset for o in collision_model(robot, **options).obstacles if o.name == "floor"]

    assert heights() == [0.0]
    assert heights(floor=-0.3) == [-0.3]
    assert heights(floor=False) == []
    assert heights(scene=Scene(obstacles=(floor(-0.4),))) == [-0.4]


def test_surroundings_are_written_and_read():
    """The floor and the boxes of a plan read back; a height that is not finite is refused."""
    pose = np.eye(4)
    pose[:3, 3] = [0.5, 0.0, 0.2]
    around = Surroundings(floor=-0.2, keep_out=(Box(name="shelf", size=[0.1, 0.2, 0.3], pose=pose),))
    again = Surroundings.from_settings(around.settings())
    assert again.settings() == around.settings()
    model = again.model(load_robot("er3a"))
    assert [o.name for o in model.obstacles] == ["floor", "shelf"]
    assert Surroundings.from_settings({}).settings() == Surroundings().settings()
    with pytest.raises(InputError, match="a floor at nan m"):
        Surroundings(floor=float("nan"))
