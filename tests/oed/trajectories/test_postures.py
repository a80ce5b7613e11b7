import dataclasses

import numpy as np
import pytest

from oed.trajectories import Posture, spread_postures
from robots.common.errors import InputError
from robots.geometry.chain import Chain, Joint
from robots.limits import Limits
from robots.loading import load_robot


def _directions(chain: Chain, poses: np.ndarray) -> np.ndarray:
    down = np.array([0.0, 0.0, -1.0])
    return np.array([[frame[:3, :3].T @ down for frame in chain.transforms(pose)] for pose in poses])  # (P, n, 3)


def _nearest(chain: Chain, poses: np.ndarray) -> float:
    """Smallest distance of two postures in the directions of gravity of all links."""
    flat = _directions(chain, poses).reshape(len(poses), -1)
    distances = np.linalg.norm(flat[:, None] - flat, axis=-1)
    return distances[np.triu_indices(len(poses), 1)].min()


def test_a_posture_rests():
    """A posture keeps its pose with all derivatives zero, at any time."""
    posture = Posture(pose=[0.1, -0.2], duration=0.5)
    q, *rates = posture.sample([-1.0, 0.0, 0.3, 9.0])
    np.testing.assert_array_equal(q, [[0.1, -0.2]] * 4)
    assert all(not rate.any() for rate in rates)
    assert (posture.n, posture.duration) == (2, 0.5)


def test_gravity_is_spread_farther_than_by_chance():
    """The two most alike of twenty postures are farther apart than in any of a hundred random draws."""
    robot = load_robot("er3a")
    poses = spread_postures(robot.chain, robot.limits, 20)
    rng = np.random.default_rng(0)
    chance = [
        _nearest(robot.chain, rng.uniform(robot.limits.lower, robot.limits.upper, size=(20, 6))) for _ in range(100)
    ]
    assert _nearest(robot.chain, poses) > max(chance)
    # Gravity comes from all sides on every link but the first, which only turns about it, and the two after that.
    directions = _directions(robot.chain, poses)
    for link in range(3, 6):
        scatter = np.linalg.eigvalsh(directions[:, link].T @ directions[:, link] / 20)
        # 1/3 in each direction is the most that can be.
        assert scatter[0] > 0.15
    for link in (1, 2):
        assert np.linalg.eigvalsh(directions[:, link].T @ directions[:, link] / 20)[1] > 0.15


def test_postures_keep_the_reserve_and_are_the_same_each_time():
    """All poses lie inside the range by the reserve, and the same call gives the same poses; more extend the choice."""
    robot = load_robot("er3a")
    poses = spread_postures(robot.chain, robot.limits, 30, reserve=0.1)
    span = robot.limits.upper - robot.limits.lower
    assert np.all(poses >= robot.limits.lower + 0.1 * span - 1e-12)
    assert np.all(poses <= robot.limits.upper - 0.1 * span + 1e-12)
    np.testing.assert_array_equal(poses, spread_postures(robot.chain, robot.limits, 30, reserve=0.1))
    fewer = spread_postures(robot.chain, robot.limits, 10, reserve=0.1)
    assert {tuple(pose) for pose in fewer} <= {tuple(pose) for pose in poses}
    np.testing.assert_array_equal(fewer[0], poses[0])


def test_where_gravity_tells_nothing_positions_are_spread():
    """Sliding joints, an upright axis, and weightlessness leave the positions to spread over the range."""
    joints = tuple(
        Joint(name=name, kind=kind, rotation=np.eye(3), translation=np.zeros(3))
        for name, kind in (("slide", "prismatic"), ("turn", "revolute"))
    )
    limits = Limits(*(sign * np.array([0.4, np.inf]) for sign in (-1, 1, 1, 1, 1, 1)))
    for gravity in (None, np.zeros(3)):
        poses = spread_postures(Chain(joints=joints), limits, 9, gravity=gravity, reserve=0.0)
        scaled = poses / [0.8, 2 * np.pi] + 0.5
        distances = np.linalg.norm(scaled[:, None] - scaled, axis=-1)[np.triu_indices(9, 1)]
        # Nine points of a unit square can be half a side apart; the greedy choice guarantees half of that.
        assert distances.min() > 0.25
        assert np.all(np.abs(poses) <= [0.4, np.pi])
    one = Chain(joints=joints[1:])
    assert spread_postures(
        one, dataclasses.replace(limits, **{name: np.array([getattr(limits, name)[1]]) for name in vars(limits)}), 3
    ).shape == (3, 1)


def test_neighbours_in_the_order_are_close():
    """The order of the postures is shorter than a random one."""
    robot = load_robot("er3a")
    poses = spread_postures(robot.chain, robot.limits, 30)
    scaled = poses / (robot.limits.upper - robot.limits.lower)

    def ways(order):
        return np.abs(np.diff(scaled[order], axis=0)).max(axis=1).sum()

    rng = np.random.default_rng(1)
    assert ways(np.arange(30)) < min(ways(rng.permutation(30)) for _ in range(100))


def test_what_makes_no_sense_is_refused():
    """Counts, reserves, sizes and times out of range are errors."""
    robot = load_robot("er3a")
    for count in (0, 10_000):
        with pytest.raises(InputError, match="postures"):
            spread_postures(robot.chain, robot.limits, count)
    with pytest.raises(InputError, match="reserve"):
        spread_postures(robot.chain, robot.limits, 3, reserve=0.5)
    with pytest.raises(InputError, match="gravity"):
        spread_postures(robot.chain, robot.limits, 3, gravity=[9.81])
    with pytest.raises(InputError, match="limits of 6 joints"):
        spread_postures(Chain(joints=robot.chain.joints[:5]), robot.limits, 3)
    for pose, duration in (([0.0], 0.0), ([], 1.0), ([np.nan], 1.0)):
        with pytest.raises(InputError):
            Posture(pose=pose, duration=duration)
