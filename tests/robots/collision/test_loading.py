from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest

from robots.collision import Box, Capsule, Plane, collision_model, loading
from robots.common.errors import AssumedValueWarning, InputError
from robots.loading import CATALOG, load_robot

YAML = """
name: two
geometry:
  convention: modified
  joints: [{a: 0, d: 0.3}, {a: 0.4}]
collision:
  links:
    - {link: 1, start: [0, 0, 0], end: [0.4, 0, 0], radius: 0.05, source: measured}
    - {link: 2, start: [0, 0, 0], end: [0.2, 0, 0], radius: 0.04, source: measured}
    - {link: 2, start: [0.2, 0, 0], end: [0.2, 0, 0.1], radius: 0.03, source: measured}
  floor: -0.1
  boxes: [{name: table, size: [1, 2, 0.5], xyz: [0.8, 0, 0], rpy: [0, 0, 0.3]}]
  capsules: [{name: post, start: [1, 1, 0], end: [1, 1, 2], radius: 0.1}]
  ignore: [[1, floor], [1, table]]
"""


def test_a_robots_file_states_its_shapes(write):
    """Capsules, obstacles and pairs to be ignored come from the robot's file; what is sourced does not warn."""
    robot = load_robot(write(YAML))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model = collision_model(robot)
    assert [capsule.name for capsule in model.capsules] == ["link 1", "link 2 (1)", "link 2 (2)"]
    plane, box, post = model.obstacles
    assert isinstance(plane, Plane)
    assert plane.offset == -0.1
    assert isinstance(box, Box)
    np.testing.assert_allclose(box.pose[:2, :2], [[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]], atol=1e-15)
    assert isinstance(post, Capsule)
    assert "table / link 1" not in model.names
    assert "post / link 1" in model.names


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("link: 1,", "link: 3,", r"robot.yaml: column collision.links\[1\].link: a capsule on link 3; allowed: 0"),
        ("radius: 0.05", "radius: -1", r"collision.links\[1\].radius"),
        ("floor: -0.1", "flor: -0.1", "unknown key 'flor'.*did you mean 'floor'"),
        ("[1, table]", "[1, sofa]", "robot.yaml.*'sofa'"),
        ("name: post", "name: table", "two obstacles are called 'table'"),
    ],
)
def test_wrong_shapes_name_the_file_and_the_key(write, old, new, message):
    """What does not fit the robot names the file, the key and what is allowed."""
    with pytest.raises(InputError, match=message):
        collision_model(load_robot(write(YAML.replace(old, new, 1))))


def test_a_robot_without_shapes_gets_capsules_along_its_links(write, monkeypatch):
    """Capsules from joint to joint, their radius a share of the reach, with one warning that they are assumed."""
    monkeypatch.setattr(loading, "_warned", set())
    robot = load_robot(write(YAML.split("collision:")[0]))
    with pytest.warns(AssumedValueWarning, match="radius 20 mm = 0.05 of the reach"):
        model = collision_model(robot, radius_fraction=0.05)
    assert [capsule.link for capsule in model.capsules] == [0, 1, 2]
    np.testing.assert_array_equal(model.capsules[1].end, robot.chain.joints[1].translation)
    assert all(capsule.radius == pytest.approx(0.05 * 0.4) for capsule in model.capsules)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        collision_model(robot, radius_fraction=0.05)
    with pytest.raises(InputError, match="2 times the reach"):
        collision_model(robot, radius_fraction=2)


def test_a_urdf_gets_capsules_along_its_links():
    """A URDF, which states no capsules, is watched too."""
    robot = load_robot(CATALOG / "ur10.urdf", tip="tool0")
    with pytest.warns(AssumedValueWarning, match="assumed") if not loading._warned else warnings.catch_warnings():
        warnings.simplefilter("ignore") if loading._warned else None
        model = collision_model(robot)
    assert len(model.capsules) == 7
    assert "base / link 2" in model.names or ("base / link 2", "touch in every pose") in model.excluded
    assert "link 2 / link 4" in model.names


def test_another_choice_of_joints_has_no_stated_capsules():
    """With other joints than the file's own its link numbers mean nothing; capsules then follow the chain."""
    robot = load_robot("panda", joints=["panda_joint1", "panda_joint2", "panda_joint4"])
    model = collision_model(robot)
    assert [capsule.link for capsule in model.capsules] == [0, 1, 2, 3]
    assert set(model.assumed) == {"base", "link 1", "link 2", "link 3"}


@pytest.mark.slow
def test_other_limits_keep_the_stated_capsules():
    """A robot whose limits were changed has the shapes of its file."""
    robot = load_robot("er3a")
    slower = replace(robot, limits=robot.limits.scaled(velocity=0.5))
    assert collision_model(slower).names == collision_model(robot).names


@pytest.mark.slow
def test_assumed_shapes_of_the_catalogue_warn_once(monkeypatch):
    """The shapes of the ER3A are assumed, which is said once; those of the Panda are the maker's."""
    monkeypatch.setattr(loading, "_warned", set())
    with pytest.warns(AssumedValueWarning, match="er3a: the link shapes for collision checks are assumed .*upper arm"):
        collision_model(load_robot("er3a"))
    panda = load_robot("panda")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        collision_model(load_robot("er3a"))
        collision_model(panda)
