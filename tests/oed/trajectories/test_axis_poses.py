import dataclasses

import numpy as np
import pinocchio
import pytest

from oed.trajectories import vertical_axis_pose
from robots.common.errors import InputError
from robots.geometry.chain import Chain, Joint
from robots.limits import Limits
from robots.loading import load_robot


def _free(n: int) -> Limits:
    return Limits(*(sign * np.full(n, 3.0) for sign in (-1, 1, 1, 1, 1, 1)))


def _arm(*kinds: str) -> Chain:
    """Joints about or along z of their frames, each frame turned by 90 degrees about x, the first one upright."""
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    return Chain(
        joints=tuple(
            Joint(name=f"J{k}", kind=kind, rotation=turn if k else np.eye(3), translation=np.array([0.3, 0.0, 0.1]))
            for k, kind in enumerate(kinds)
        )
    )


@pytest.mark.parametrize("joint", range(1, 7))
def test_er3a_stands_upright_where_the_thesis_says(joint):
    """The axes of joints 1, 4, 5 and 6 can be made vertical, those of joints 2 and 3 cannot (thesis section 2.4)."""
    robot = load_robot("er3a")
    pose, angle = vertical_axis_pose(robot.chain, joint, robot.limits)
    if joint in (2, 3):
        assert angle == pytest.approx(np.pi / 2, abs=1e-9)
    else:
        assert angle < 1e-6
    assert np.all((pose >= robot.limits.lower) & (pose <= robot.limits.upper))


@pytest.mark.parametrize("joint", [1, 4, 5, 6])
def test_gravity_does_no_work_on_the_posed_joint(joint):
    """By pinocchio, with links of uneven mass, the torque of gravity on that joint vanishes wherever it stands."""
    robot = load_robot("er3a")
    pose, _ = vertical_axis_pose(robot.chain, joint, robot.limits)
    model = pinocchio.Model()
    parent = 0
    for item in robot.chain.joints:
        placement = pinocchio.SE3(np.array(item.rotation), np.array(item.translation))
        axis = pinocchio.JointModelRevoluteUnaligned(*(float(value) for value in item.axis))
        parent = model.addJoint(parent, axis, placement, item.name)
        inertia = pinocchio.Inertia(3.0, np.array([0.1, -0.2, 0.3]), np.eye(3))
        model.appendBodyToJoint(parent, inertia, pinocchio.SE3.Identity())
    data = model.createData()
    for turned in (-1.0, 0.0, 0.7):
        q = np.array(pose)
        q[joint - 1] += turned
        torque = pinocchio.computeGeneralizedGravity(model, data, q)
        # Some 10 N m at a microradian.
        assert abs(torque[joint - 1]) < 1e-4
    assert np.abs(torque).max() > 1.0


@pytest.mark.slow
def test_the_fewest_joints_move_and_least():
    """Joints that do not help stay at home, and of equally good poses the one that moves fewer joints is taken."""
    robot = load_robot("er3a")
    home = np.array([0.5, 0.1, 0.0, 0.0, 0.2, -1.0])
    pose, angle = vertical_axis_pose(robot.chain, 4, robot.limits, home=home)
    assert angle < 1e-6
    np.testing.assert_array_equal(pose[[0, 3, 4, 5]], home[[0, 3, 4, 5]])
    again, _ = vertical_axis_pose(robot.chain, 4, robot.limits, home=home)
    np.testing.assert_array_equal(pose, again)
    straight, _ = vertical_axis_pose(robot.chain, 6, robot.limits)
    # Tilting the upper arm, the forearm or the hand by 90 degrees would do: the hand is the smallest.
    np.testing.assert_allclose(np.abs(straight), [0, 0, 0, 0, np.pi / 2, 0], atol=1e-12)


@pytest.mark.slow
def test_an_inclined_base_and_narrow_limits_are_taken_into_account():
    """With gravity at an odd angle the wrist still aligns; limits that forbid it leave the angle they must."""
    robot = load_robot("er3a")
    tilted = np.array([2.0, -3.0, -9.0])
    _, angle = vertical_axis_pose(robot.chain, 6, robot.limits, tilted)
    assert angle < 1e-6
    _, base = vertical_axis_pose(robot.chain, 1, robot.limits, tilted)
    assert base == pytest.approx(np.arctan2(np.hypot(2.0, 3.0), 9.0))
    chain = _arm("revolute", "revolute", "revolute")
    narrow = dataclasses.replace(_free(3), lower=np.array([-3.0, -0.4, -3.0]), upper=np.array([3.0, 0.7, 3.0]))
    # The third axis lies at q2 = 0 up to a sign; whichever end of the range turns it most is best.
    _, left = vertical_axis_pose(chain, 3, narrow)
    frames = chain.transforms(np.stack([np.zeros(1101), np.linspace(-0.4, 0.7, 1101), np.zeros(1101)], axis=1))
    scanned = np.arccos(np.abs(frames[:, 2, 2, 2])).min()
    assert left == pytest.approx(scanned, abs=1e-4)


def test_a_prismatic_axis_is_laid_level():
    """Gravity does no work on a sliding joint whose axis is horizontal."""
    chain = _arm("revolute", "revolute", "prismatic")
    pose, angle = vertical_axis_pose(chain, 3, _free(3), home=[0.0, 0.9, 0.0])
    assert angle < 1e-6
    axis = chain.transforms(pose)[2, :3, 2]
    assert abs(axis[2]) < 1e-6
    _, upright = vertical_axis_pose(_arm("prismatic"), 1, _free(1))
    assert upright == pytest.approx(np.pi / 2)


def test_what_makes_no_sense_is_refused():
    """No such joint, limits of another size, no gravity and a home pose outside are errors."""
    robot = load_robot("er3a")
    for joint in (0, 7):
        with pytest.raises(InputError, match="joint does not exist"):
            vertical_axis_pose(robot.chain, joint, robot.limits)
    with pytest.raises(InputError, match="limits of 5 joints"):
        vertical_axis_pose(robot.chain, 1, _free(5))
    for gravity in ([0.0, 0.0, 0.0], [1.0, 2.0]):
        with pytest.raises(InputError, match="gravity"):
            vertical_axis_pose(robot.chain, 1, robot.limits, gravity)
    with pytest.raises(InputError, match="home pose 9 rad lies outside"):
        vertical_axis_pose(robot.chain, 1, robot.limits, home=[9.0, 0, 0, 0, 0, 0])
