"""Joints are found by name, vendors' prefixes aside."""

import pytest

from estimation.logs.readers.joint_names import places

UR = ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint"]


@pytest.mark.parametrize(
    ("found", "wanted", "expected"),
    [
        (["b", "a"], ["a", "b"], [1, 0]),
        (["gripper", "b", "a"], ["a", "b"], [2, 1]),
        (["left_elbow_joint", "left_shoulder_lift_joint", "left_shoulder_pan_joint"], UR, [2, 1, 0]),
        (UR, ["arm/" + name for name in UR], [0, 1, 2]),
        (["fr3_joint2", "fr3_finger_joint1", "fr3_joint1"], ["panda_joint1", "panda_joint2"], [2, 0]),
        (["elbow"], ["J1"], None),
        (["a"], ["a", "b"], None),
        ([*("left_" + name for name in UR), *("right_" + name for name in UR)], UR, None),
        (["xelbow_joint"], ["elbow_joint"], None),
        (["fr3_joint1", "fr3_joint3"], ["panda_joint1", "panda_joint2"], None),
    ],
)
def test_places(found, wanted, expected):
    """Other prefixes count where they leave no doubt; else no place is given."""
    assert places(found, wanted) == expected
