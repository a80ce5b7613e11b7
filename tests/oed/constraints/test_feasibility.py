from __future__ import annotations

import re

import numpy as np
import pytest

from oed.constraints.feasibility import check_feasible, nearest_feasible, tool_approach
from oed.constraints.geometric import CollisionLimit, GeometricLimits
from oed.constraints.singularity import SingularityLimit
from oed.constraints.tool import PlaneLimit, ToolBox
from robots.collision import Box, Scene, collision_model, floor
from robots.common.errors import InfeasibleError, InputError
from robots.geometry.chain import homogeneous
from robots.loading import load_robot

HOME = np.array([0.0, 0.0, 0.0, 0.0, -0.6, 0.0])


@pytest.fixture(autouse=True)
def _without_compiler(monkeypatch):
    """Compiling takes longer than these tests."""
    monkeypatch.setenv("ROBOT_OED_BACKEND", "vectorised")


@pytest.fixture
def robot():
    return load_robot("er3a")


def _limits(robot, *others, obstacles=(), margin=0.005):
    collisions = CollisionLimit(model=collision_model(robot, scene=Scene(obstacles=obstacles)), margin=margin)
    return GeometricLimits(robot=robot, limits=(collisions, *others))


@pytest.mark.slow
def test_a_good_start_passes(robot):
    """A free start pose with its tool in the box, off singular poses, is accepted."""
    box = ToolBox(lower=(0.2, -0.5, 0.1), upper=(0.8, 0.5, 1.0))
    limits = _limits(robot, box, SingularityLimit(smallest=0.05), obstacles=(floor(0.0),))
    check_feasible(robot, limits, HOME)


@pytest.mark.slow
def test_a_start_pose_in_itself_names_the_pair_and_the_depth(robot):
    """The overlapping bodies, their depth and a pose that would do are named; that pose is free."""
    home = np.array([0.0, -2.0, -1.2, 0.0, 0.0, 0.0])
    limits = _limits(robot)
    model = limits.limits[0].model
    clearance = model.clearance(home)[0]
    with pytest.raises(InfeasibleError) as caught:
        check_feasible(robot, limits, home)
    text = str(caught.value)
    first, second = model.names[int(clearance.argmin())].split(" / ")
    assert f"{first!r} and {second!r} overlap by {-1e3 * clearance.min():.1f} mm" in text
    pose = np.array([float(x) for x in re.findall(r"-?\d\.\d{3}", text.split("nearest pose")[1])])
    assert model.clearance(pose).min() > 0.0


@pytest.mark.slow
def test_the_floor_that_would_do_is_stated(robot):
    """Of a floor that the arm stands in, the height that would do is stated, and does."""
    with pytest.raises(InfeasibleError) as caught:
        check_feasible(robot, _limits(robot, obstacles=(floor(0.2),)), HOME)
    assert "'floor'" in str(caught.value)
    height = float(re.search(r"plane at (-?[\d.]+) m or lower", str(caught.value)).group(1))
    assert 0.1 < height < 0.2
    check_feasible(robot, _limits(robot, obstacles=(floor(height - 1e-4),)), HOME)


def test_a_floor_above_the_first_joint_is_named(robot):
    """A floor above the foot is reported as such, with the height of the first joint."""
    with pytest.raises(InfeasibleError, match=r"'floor' at 0.4 m is above the first joint, which is at 0.3215 m"):
        check_feasible(robot, _limits(robot, obstacles=(floor(0.4),)), HOME)


@pytest.mark.slow
def test_less_than_the_margin_is_distinguished_from_an_overlap(robot):
    """A start pose that is free but nearer than the margin says both."""
    model = collision_model(robot)
    least = model.clearance(HOME).min()
    assert least > 0
    with pytest.raises(InfeasibleError, match=rf"are {1e3 * least:.1f} mm apart, less than the margin of 300.0 mm"):
        check_feasible(robot, _limits(robot, margin=0.3), HOME)


@pytest.mark.slow
def test_an_obstacle_in_the_way(robot):
    """A start pose within a box is refused by the box's name."""
    post = Box(name="post", size=[0.1, 0.1, 1.0], pose=homogeneous(np.eye(3), [0.3, 0.0, 0.5]))
    with pytest.raises(InfeasibleError, match=r"'post' and 'forearm"):
        check_feasible(robot, _limits(robot, obstacles=(post,)), HOME)


@pytest.mark.slow
def test_a_box_out_of_reach_states_the_nearest_point(robot):
    """A tool box out of reach is refused with the distance and the box that would do, by the arm's closed form."""
    limits = GeometricLimits(robot=robot, limits=(ToolBox(lower=(1.0, 0.0, 0.0), upper=(2.0, 1.0, 1.0)),))
    with pytest.raises(InfeasibleError, match="cannot reach its box") as caught:
        check_feasible(robot, limits, HOME)
    # stretched out, the wrist bent into the line: 50 + 270 + |(70, 299)| + 78 mm from the axis of joint 1
    reach = 0.05 + 0.27 + np.hypot(0.07, 0.299) + 0.078
    low = float(re.search(r"x from ([\d.]+) m", str(caught.value)).group(1))
    assert low == pytest.approx(reach, abs=1e-4)  # four digits are printed


@pytest.mark.slow
def test_the_approach_is_zero_within_reach(robot):
    """A box that the tool can enter is at no distance, however small it is."""
    place = robot.chain.flange(HOME)[:3, 3]
    small = ToolBox(lower=tuple(place - 1e-3), upper=tuple(place + 1e-3))
    assert tool_approach(robot, small)[0] < 1e-6


def test_a_start_outside_of_the_box_says_by_how_much(robot):
    """A box that is within reach but not around the start pose names the side and the distance."""
    box = ToolBox(lower=(0.0, 0.2, 0.0), upper=(1.0, 1.0, 1.0))
    with pytest.raises(InfeasibleError, match=r"'tool y >= 0.2' by 0.2 m"):
        check_feasible(robot, GeometricLimits(robot=robot, limits=(box,)), HOME)


def test_a_singular_start_and_a_plane(robot):
    """The stretched wrist at zero is refused by its distance; a wrist under a plane by its height."""
    singular = GeometricLimits(robot=robot, limits=(SingularityLimit(smallest=0.05),))
    with pytest.raises(InfeasibleError, match=r"'distance to singularity' by 0.05;.*nearest pose"):
        check_feasible(robot, singular, np.zeros(6))
    high = GeometricLimits(robot=robot, limits=(PlaneLimit(link=5, normal=(0, 0, 1), offset=0.7, name="wrist up"),))
    with pytest.raises(InfeasibleError, match=r"'wrist up' by 0.0385 m"):
        check_feasible(robot, high, HOME)


def test_a_start_beyond_a_joints_limit_names_the_joint(robot):
    """A start pose out of a joint's range names the joint and its range; another number of joints is bad input."""
    with pytest.raises(InfeasibleError, match="joint 3"):
        check_feasible(robot, _limits(robot), [0, 0, 2.0, 0, 0, 0])
    with pytest.raises(InputError, match="6 finite numbers"):
        check_feasible(robot, _limits(robot), [0, 0, 0])


def test_no_pose_may_keep_all_limits(robot):
    """Where no pose keeps all limits, none is claimed to."""
    low = PlaneLimit(link=6, normal=(0, 0, -1), offset=2.0)
    assert nearest_feasible(GeometricLimits(robot=robot, limits=(low,)), HOME) is None
