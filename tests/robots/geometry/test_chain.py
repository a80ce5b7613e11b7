"""A serial chain of joints and its numeric kinematics."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robots.common.errors import InputError
from robots.geometry.chain import Chain, Joint, homogeneous, joint_motion, rotation_from_rpy

EYE = np.eye(3)


def joint(name="a", kind="revolute", rotation=EYE, translation=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0)):
    return Joint(name, kind, rotation, translation, axis)


def test_roll_pitch_yaw_turn_about_fixed_axes():
    """Roll, pitch and yaw are turns about the fixed x, y and z axes, in this order."""
    for rpy in np.random.default_rng(1).uniform(-np.pi, np.pi, size=(20, 3)):
        expected = Rotation.from_euler("xyz", rpy).as_matrix()
        np.testing.assert_allclose(rotation_from_rpy(rpy), expected, atol=1e-15)  # products of three cosines


def test_a_revolute_joint_turns_about_its_axis():
    """A revolute joint turns by q about its axis, oblique ones included."""
    random = np.random.default_rng(2)
    for _ in range(20):
        axis, q = random.normal(size=3), random.uniform(-7, 7)
        axis /= np.linalg.norm(axis)
        expected = homogeneous(Rotation.from_rotvec(q * axis).as_matrix(), np.zeros(3))
        np.testing.assert_allclose(joint_motion("revolute", axis, q), expected, atol=5e-15)  # rounding of a unit axis


def test_a_prismatic_joint_slides_along_its_axis():
    """A prismatic joint shifts by q along its axis and does not turn."""
    axis = np.array([0.6, 0.0, 0.8])
    expected = homogeneous(EYE, 0.3 * axis)
    np.testing.assert_array_equal(joint_motion("prismatic", axis, 0.3), expected)


def test_a_tiny_angle_keeps_its_digits():
    """A turn of 1e-9 rad changes the rotation by its sine and versine without cancellation."""
    motion = joint_motion("revolute", [0.0, 0.0, 1.0], 1e-9)
    assert motion[1, 0] == 1e-9  # sin(x) is x to the last digit here
    assert joint_motion("revolute", [1.0, 1.0, 0.0] / np.sqrt(2.0), 1e-9)[0, 1] == pytest.approx(2.5e-19, rel=1e-12)


def test_poses_follow_one_another_from_the_base():
    """Each link's pose is its parent's pose, the joint's placement and the joint's motion, one after the other."""
    first = joint("a", translation=(0, 0, 1), rotation=rotation_from_rpy([0.3, 0.2, 0.1]))
    second = joint("b", "prismatic", translation=(1, 0, 0), axis=(0, 1, 0))
    tip = homogeneous(EYE, [0.0, 0.0, 0.5])
    chain = Chain((first, second), tip=tip)
    poses = chain.transforms([0.4, 0.7])
    np.testing.assert_array_equal(poses[0], first.transform(0.4))
    np.testing.assert_allclose(poses[1], first.transform(0.4) @ second.transform(0.7), atol=1e-16)
    np.testing.assert_allclose(chain.flange([0.4, 0.7]), poses[1] @ tip, atol=1e-16)


def test_many_samples_at_once_equal_each_alone():
    """Positions of many samples give the poses of each sample."""
    chain = Chain((joint("a", axis=(1, 2, 3)), joint("b", "prismatic", translation=(0.1, 0, 0))))
    q = np.random.default_rng(3).normal(size=(5, 2))
    np.testing.assert_allclose(chain.transforms(q), [chain.transforms(row) for row in q], atol=1e-16)
    assert chain.flange(q).shape == (5, 4, 4)


def test_the_axis_is_normalised():
    """An axis of any length means its direction."""
    np.testing.assert_allclose(joint(axis=(0, 3, 4)).axis, [0.0, 0.6, 0.8], atol=1e-16)


def test_rounding_in_a_rotation_becomes_exact_zero():
    """A quarter turn computed from its angle has exact zeros, which keep symbolic dynamics sparse."""
    quarter = rotation_from_rpy([np.pi / 2, 0.0, 0.0])
    assert quarter[1, 1] != 0.0
    assert np.count_nonzero(joint(rotation=quarter).rotation) == 3


def test_arrays_cannot_be_changed():
    """A chain is frozen down to its arrays."""
    chain = Chain((joint(),))
    for array in (chain.gravity, chain.tip, chain.joints[0].axis, chain.joints[0].rotation):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"axis": (0, 0, 0)}, "joint a: the axis has no length"),
        ({"axis": (0, 0, np.nan)}, "joint a: the axis is not finite"),
        ({"axis": (0, 1)}, "joint a: the axis has the shape"),
        ({"rotation": 2 * EYE}, "joint a: the rotation is not a proper rotation"),
        ({"rotation": np.diag([1.0, 1.0, -1.0])}, "joint a: the rotation is not a proper rotation"),
        ({"translation": "abc"}, "joint a: the translation is not numeric"),
        ({"kind": "planar"}, "joint a: unknown kind 'planar'; allowed: revolute or prismatic"),
    ],
)
def test_an_impossible_joint_is_refused(changes, message):
    """A joint that cannot be is refused, by name and with the reason."""
    with pytest.raises(InputError, match=message):
        joint(**changes)


def test_an_impossible_chain_is_refused():
    """A chain without joints, with a name used twice, or asked about the wrong number of positions is refused."""
    with pytest.raises(InputError, match="at least one moving joint"):
        Chain(())
    with pytest.raises(InputError, match="joint a: the joint name is used twice"):
        Chain((joint("a"), joint("a")))
    with pytest.raises(InputError, match="not homogeneous"):
        Chain((joint(),), tip=np.ones((4, 4)))
    with pytest.raises(InputError, match="a last dimension of 1"):
        Chain((joint(),)).transforms([1.0, 2.0])
