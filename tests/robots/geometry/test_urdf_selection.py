"""Choosing the moving joints of a branched URDF."""

from __future__ import annotations

import pytest

from robots.common.errors import InputError
from robots.geometry.urdf import read_urdf

BODY = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
LIMIT = '<limit lower="-1" upper="1" velocity="2" effort="3"/>'


def attach(name, parent, child, kind="revolute", inside=""):
    body = f'<link name="{child}">{BODY}</link><joint name="{name}" type="{kind}">{inside}'
    return f'{body}<parent link="{parent}"/><child link="{child}"/>{LIMIT}</joint>'


ARM = (
    '<link name="base"/>'
    + attach("j1", "base", "l1")
    + attach("j2", "l1", "l2")
    + attach("j3", "l2", "l3")
    + attach("camera_mount", "l1", "camera", "fixed")
    + attach("hand_mount", "l3", "hand", "fixed")
)
FINGERS = attach("left", "hand", "left_finger", "prismatic") + attach(
    "right", "hand", "right_finger", "prismatic", '<mimic joint="left"/>'
)


def test_an_unbranched_robot_needs_no_choice(write_urdf):
    """Frames fixed along the arm are no second choice: the whole arm moves, and its end is the flange."""
    taken = read_urdf(write_urdf(ARM)).chain()
    assert taken.names == ("j1", "j2", "j3")


def test_a_gripper_makes_the_choice_ambiguous(write_urdf):
    """Where several chains end in moving joints of their own, the message lists each tip link with its joints."""
    with pytest.raises(InputError) as caught:
        read_urdf(write_urdf(ARM + FINGERS)).chain()
    message = str(caught.value)
    assert "branches into 2 chains" in message
    assert "left_finger: j1, j2, j3, left; right_finger: j1, j2, j3, right" in message
    assert "choose one by its tip (--tip) or its joints (--joints), or lock joints (--lock)" in message


@pytest.mark.parametrize(
    ("choice", "names"),
    [
        ({"tip": "hand"}, ("j1", "j2", "j3")),
        ({"tip": "left_finger"}, ("j1", "j2", "j3", "left")),
        ({"tip": "camera"}, ("j1",)),
        ({"joints": ["j1", "j2", "j3"]}, ("j1", "j2", "j3")),
        ({"joints": ["j2"], "tip": "hand"}, ("j2",)),
        ({"joints": ("j1", "j3")}, ("j1", "j3")),
        ({"locked": {"left": 0.1, "right": 0.1}}, ("j1", "j2", "j3")),
        ({"tip": "hand", "locked": {"j2": 0.5}}, ("j1", "j3")),
        ({"tip": "right_finger", "locked": {"right": 0.0}}, ("j1", "j2", "j3")),
    ],
)
def test_a_choice_gives_its_chain(choice, names, write_urdf):
    """A tip link, joint names, or locked joints choose the chain."""
    assert read_urdf(write_urdf(ARM + FINGERS)).chain(**choice).names == names


@pytest.mark.parametrize(
    ("choice", "message"),
    [
        ({"tip": "hnad"}, "there is no link 'hnad'; did you mean 'hand'"),
        ({"tip": "base"}, "no joint moves between the root and link 'base'"),
        ({"joints": ["J2"]}, "there is no joint 'J2'; did you mean 'j2'"),
        ({"joints": []}, "the list of moving joints is empty"),
        ({"joints": ["j2", "j1"]}, "not in the chain's order: j2, j1; allowed: j1, j2"),
        ({"joints": ["j1", "j1"]}, "joint j1: the joint is named twice"),
        ({"joints": ["j1", "hand_mount"]}, "joint hand_mount: a fixed joint cannot be selected as a moving joint"),
        ({"joints": ["j1", "left", "right"]}, "does not lie between the root and link '(left|right)_finger'"),
        ({"joints": ["j1", "j2"], "tip": "camera"}, "joint j2: the joint does not lie between .* one path: j1"),
        ({"joints": ["j1"], "locked": {"j1": 0.0}}, "joint j1: the joint is both moving and locked"),
        ({"joints": ["j1", "right"]}, "joint right: the joint lies on the chain but mimics 'left'"),
        ({"tip": "right_finger"}, "joint right: the joint lies on the chain but mimics 'left'"),
        ({"locked": {"jj": 0.0}}, "there is no joint 'jj'"),
        ({"locked": {"hand_mount": 0.0}}, "joint hand_mount: a fixed joint cannot be locked"),
        ({"locked": {"j1": float("nan")}}, "joint j1: locked at nan"),
        ({"locked": {"j1": 90.0}}, "joint j1: locked at 90, beyond its limits; allowed: -1 to 1 rad"),
        ({"locked": {"left": 5.0}}, "allowed: -1 to 1 m"),
    ],
)
def test_a_choice_that_does_not_fit_is_refused(choice, message, write_urdf):
    """A choice that names what does not exist or does not fit is refused, with what would."""
    with pytest.raises(InputError, match=message):
        read_urdf(write_urdf(ARM + FINGERS)).chain(**choice)


def test_a_long_list_of_choices_is_cut(write_urdf):
    """Of a robot with dozens of tips, a dozen choices are listed."""
    body = ARM + "".join(attach(f"s{i}", "base", f"side{i}") for i in range(20))
    with pytest.raises(InputError, match=r"branches into 21 chains.* and 10 more"):
        read_urdf(write_urdf(body)).chain()
