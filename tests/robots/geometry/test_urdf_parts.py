"""Every part of a URDF is read, or a note names it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robots.common.errors import AssumedValueWarning, InputError
from robots.geometry.urdf import read_urdf
from robots.loading import load_robot

BODY = (
    '<inertial><origin xyz="0.2 0 0"/><mass value="1"/>'
    '<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial>'
)
LIMIT = '<limit lower="-1" upper="1" velocity="2" effort="3"/>'


def arm(inside=LIMIT, kind="revolute", body=BODY, more=""):
    """A base, one link, and the joint between them."""
    head = f'<joint name="j1" type="{kind}"><parent link="base"/><child link="l1"/>'
    return f'<link name="base"/><link name="l1">{body}</link>{head}{inside}</joint>{more}'


def limited(**limits):
    """A joint with further or other limits."""
    stated = {"lower": "-1", "upper": "1", "velocity": "2", "effort": "3"} | limits
    return arm("<limit " + " ".join(f'{key}="{value}"' for key, value in stated.items() if value is not None) + "/>")


@pytest.mark.parametrize("seed", range(5))
def test_a_quaternion_turns_as_scipy_says(seed, write_urdf):
    """URDF 1.1 states rotations of joints and bodies as quat_xyzw, which may be rounded to three digits."""
    rotation = Rotation.random(random_state=seed)
    written = " ".join(f"{value:.9f}" for value in rotation.as_quat())
    taken = read_urdf(write_urdf(arm(f'{LIMIT}<origin xyz="1 2 3" quat_xyzw="{written}"/>'))).chain()
    np.testing.assert_allclose(taken.chain.joints[0].rotation, rotation.as_matrix(), atol=1e-8)
    np.testing.assert_array_equal(taken.chain.joints[0].translation, [1, 2, 3])
    turned = BODY.replace('<origin xyz="0.2 0 0"/>', f'<origin xyz="0 0 0" quat_xyzw="{written}"/>')
    inertia = read_urdf(write_urdf(arm(body=turned))).chain().inertia[0, 4:]
    expected = rotation.as_matrix() @ np.diag([0.01, 0.02, 0.02]) @ rotation.as_matrix().T
    np.testing.assert_allclose(inertia, expected[np.triu_indices(3)], atol=1e-9)  # nine digits written


def test_a_rounded_quaternion_is_normalised(write_urdf):
    """A quaternion of three digits is one of a rotation."""
    taken = read_urdf(write_urdf(arm(f'{LIMIT}<origin quat_xyzw="0.707 0 0 0.707"/>'))).chain()
    np.testing.assert_allclose(taken.chain.joints[0].rotation, [[1, 0, 0], [0, 0, -1], [0, 1, 0]], atol=1e-15)


REFUSED = {
    "both rotations": (arm(f'{LIMIT}<origin rpy="0 0 0" quat_xyzw="0 0 0 1"/>'), "both rpy and quat_xyzw"),
    "no unit quaternion": (arm(f'{LIMIT}<origin quat_xyzw="0 0 0 0"/>'), "quat_xyzw has the length 0"),
    "three numbers": (arm(f'{LIMIT}<origin quat_xyzw="0 0 1"/>'), "quat_xyzw is '0 0 1'; allowed: 4"),
    "two limits": (arm(LIMIT + LIMIT), "joint j1: 2 <limit> elements; allowed: one"),
    "two bodies": (arm(body=BODY + BODY), "link 'l1': 2 <inertial> elements"),
    "negative acceleration": (limited(acceleration="-1"), "<limit> acceleration is -1; allowed: zero or more"),
    "negative jerk": (limited(jerk="-5"), "<limit> jerk is -5"),
    "negative damping": (arm(LIMIT + '<dynamics damping="-0.1"/>'), "<dynamics> damping is -0.1"),
    "soft limits reversed": (
        arm(LIMIT + '<safety_controller k_velocity="1" soft_lower_limit="0.5" soft_upper_limit="-0.5"/>'),
        "soft limits of <safety_controller> leave no range",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_meant_is_refused(case, write_urdf):
    """Statements that contradict each other, or that no robot has, are refused with the joint or link."""
    body, message = REFUSED[case]
    with pytest.raises(InputError, match=message):
        read_urdf(write_urdf(body)).chain()


@pytest.mark.parametrize(
    ("stated", "expected", "note"),
    [
        ({"acceleration": "3"}, 3.0, None),
        ({"deceleration": "2"}, 2.0, None),
        ({"acceleration": "3", "deceleration": "3"}, 3.0, None),
        ({"acceleration": "3", "deceleration": "1"}, 1.0, "the deceleration (1) counts for both"),
        ({"acceleration": "1", "deceleration": "3"}, 1.0, "the acceleration (1) counts for both"),
    ],
)
def test_acceleration_limits_of_urdf_1_2_are_limits(stated, expected, note, write_urdf):
    """The smaller one of acceleration and deceleration is the limit, which a note says; jerk is one, too."""
    taken = read_urdf(write_urdf(limited(**stated, jerk="20"))).chain()
    assert (taken.limits.acceleration[0], taken.limits.jerk[0]) == (expected, 20.0)
    assert [text for text in taken.notes if "counts for both" in text] == ([] if note is None else list(taken.notes))
    assert note is None or note in taken.notes[0]


@pytest.mark.parametrize(
    ("stops", "soft", "expected"),
    [
        (("-1", "1"), 'soft_lower_limit="-0.8" soft_upper_limit="0.9"', (-0.8, 0.9)),
        (("-1", "1"), 'soft_lower_limit="-2" soft_upper_limit="2"', (-1.0, 1.0)),
        (("-1", "1"), 'soft_upper_limit="0.5"', (-1.0, 0.5)),
        (("-1", "1"), "", (-1.0, 1.0)),
        (("0", "0"), 'soft_lower_limit="-0.8" soft_upper_limit="0.9"', (-0.8, 0.9)),
    ],
)
def test_soft_limits_count(stops, soft, expected, write_urdf):
    """The tighter one of a stop and its soft limit is the position limit; a note says where the soft one is."""
    lower, upper = stops
    inside = (
        f'<limit lower="{lower}" upper="{upper}" velocity="2" effort="3"/><safety_controller k_velocity="1" {soft}/>'
    )
    taken = read_urdf(write_urdf(arm(inside))).chain()
    assert (taken.limits.lower[0], taken.limits.upper[0]) == expected
    assert taken.unlimited == ()
    assert any("soft limits" in note for note in taken.notes) == (expected != (-1.0, 1.0))


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
@pytest.mark.parametrize(
    "limit",
    [
        '<limit velocity="1" effort="2"/>',
        '<limit lower="0" upper="0" velocity="1" effort="2"/>',
        '<limit upper="0.0" velocity="1" effort="2"/>',
        '<limit lower="-1e16" upper="1e16" velocity="1" effort="2"/>',
    ],
)
def test_a_joint_without_stops_is_refused_unless_accepted(kind, limit, write_urdf):
    """Position limits that are missing or zero are refused; on request the joint is unlimited, and a note says so."""
    path = write_urdf(arm(limit, kind))
    with pytest.raises(InputError, match=r"joint j1: <limit> states no position limits.*--unlimited"):
        load_robot(path)
    with pytest.warns(AssumedValueWarning, match="joint j1: no position limits stated; positions are unlimited"):
        robot = load_robot(path, unlimited=True)
    assert (robot.limits.lower[0], robot.limits.upper[0]) == (-np.inf, np.inf)


def test_a_yaml_states_the_stops_that_the_urdf_lacks(write_urdf, tmp_path):
    """Position limits of a robot YAML make up for missing ones of its URDF."""
    path = write_urdf(arm('<limit velocity="1" effort="2"/>'))
    text = f"name: a\nurdf: {path.name}\n"
    (path.parent / "a.yaml").write_text(text)
    with pytest.raises(InputError, match="states no position limits"):
        load_robot(path.parent / "a.yaml")
    (path.parent / "a.yaml").write_text(text + "limits: {position: {lower: -10, upper: 20, unit: deg}}\n")
    robot = load_robot(path.parent / "a.yaml")
    np.testing.assert_allclose([robot.limits.lower[0], robot.limits.upper[0]], np.deg2rad([-10, 20]))


def test_one_missing_stop_is_zero_and_said(write_urdf):
    """A range with one missing end ends at 0, as the specification says, and a note says so."""
    taken = read_urdf(write_urdf(limited(lower=None))).chain()
    assert (taken.limits.lower[0], taken.limits.upper[0]) == (0.0, 1.0)
    assert taken.notes == ("joint j1: <limit> states no lower; it is 0 by the URDF specification",)


@pytest.mark.parametrize(
    ("kind", "stated", "expected"),
    [
        ("revolute", {"lower": "-170", "upper": "170"}, "position limits up to 170 rad look like degrees"),
        ("revolute", {"velocity": "180"}, "a velocity limit of 180 rad/s looks like degrees per second"),
        ("prismatic", {"lower": "0", "upper": "400"}, "position limits up to 400 m look like millimetres"),
        ("prismatic", {"velocity": "500"}, "a velocity limit of 500 m/s looks like millimetres per second"),
        ("revolute", {"lower": "-6.29", "upper": "6.29", "velocity": "40"}, None),
        ("prismatic", {"lower": "0", "upper": "6", "velocity": "4"}, None),
    ],
)
def test_limits_in_other_units_are_named(kind, stated, expected, write_urdf):
    """Limits that only make sense in degrees or millimetres are named with the joint; plausible ones are not."""
    body = limited(**stated).replace('type="revolute"', f'type="{kind}"')
    notes = read_urdf(write_urdf(body)).chain().notes
    assert notes == (() if expected is None else (f"joint j1: {expected}",))


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        (BODY, None),
        (BODY.replace('ixx="0.01"', 'ixx="0.05"'), "principal moments of 0.02, 0.02 and 0.05 kg m2 that no body has"),
        (BODY.replace('iyy="0.02"', 'iyy="0.0302"'), None),  # 0.0302 > 0.01 + 0.02 by rounding only
        (BODY.replace("0.2 0 0", "200 0 0"), "a centre of mass 200 m from its joint"),
        (
            BODY.replace("0.01", "12").replace("0.02", "12"),
            "an inertia of 12 kg m2 with 1 kg, as if its mass were 3.46 m away",
        ),
    ],
)
def test_doubtful_bodies_are_named(body, expected, write_urdf):
    """Inertias that no mass distribution has, and those of other units, are named with their link."""
    notes = read_urdf(write_urdf(arm(body=body))).chain().notes
    assert len(notes) == (expected is not None)
    assert expected is None or notes[0].startswith(f"link l1 has {expected}")


def test_unused_parts_are_named_once(write_urdf):
    """Unknown elements and attributes, and those of other name spaces, are listed in one note."""
    inside = LIMIT + '<dynamics damping="1" armature="0.1"/><drake:rotor_inertia xmlns:drake="http://drake.mit.edu"/>'
    more = "".join(f'<transmission name="t{i}"><joint name="j1"/></transmission>' for i in range(5))
    more += (
        '<drake:joint xmlns:drake="http://drake.mit.edu" name="b" type="ball"/><gazebo reference="l1"/><Link name="x"/>'
    )
    drawn = BODY + '<visual><geometry><mesh filename="a.stl"/></geometry><anything/></visual>'
    path = write_urdf(arm(inside.replace("damping=", 'dampping="3" damping='), body=drawn, more=more))
    with pytest.warns(AssumedValueWarning, match="not used from the URDF") as caught:
        robot = load_robot(path)
    notes = [str(warning.message) for warning in caught if "not used" in str(warning.message)]
    assert len(notes) == 1
    assert notes[0].endswith(
        ": not used from the URDF: dynamics dampping, similar to damping (j1); dynamics armature (j1); "
        "<drake.mit.edu:rotor_inertia> (j1); <transmission> (5 times); <drake.mit.edu:joint> (b); <gazebo> (1 times); "
        "<Link>, similar to link (x)"
    )
    assert robot.joint_names == ("j1",)


@pytest.mark.parametrize(("distance", "noted"), [(0.4, False), (400.0, True)])
def test_lengths_in_millimetres_are_noted(distance, noted, write_urdf):
    """A link of 400 m is one of 400 mm."""
    more = (
        f'<link name="l2">{BODY}</link><joint name="j2" type="revolute"><parent link="l1"/><child link="l2"/>'
        f'<origin xyz="{distance} 0 0"/>{LIMIT}</joint>'
    )
    notes = load_robot(write_urdf(arm(more=more))).notes
    assert any("may be in millimetres" in note for note in notes) == noted


def test_a_default_name_space_is_a_urdf(write_urdf):
    """A file whose root declares a default name space is read as any other."""
    path = write_urdf(arm())
    path.write_text(path.read_text().replace("<robot ", '<robot xmlns="http://www.ros.org" ', 1))
    tree = read_urdf(path)
    assert tree.chain().names == ("j1",)
    assert tree.unused == ()


def test_a_bare_urdf_lists_what_is_assumed(write_urdf):
    """One note lists what a URDF without these parts is taken to be, in the units of its joints."""
    slide = '<link name="l2">' + BODY + '</link><joint name="j2" type="prismatic"><parent link="l1"/>'
    slide += '<child link="l2"/><limit lower="-1" upper="1" velocity="0.5" effort="3"/></joint>'
    with pytest.warns(AssumedValueWarning, match="assumed, because") as caught:
        load_robot(write_urdf(arm(LIMIT + '<dynamics damping="1"/>', more=slide)))
    text = str(caught[0].message)
    for part in (
        "acceleration limits 8 rad/s2, 2 m/s2 (full speed in 0.25 s)",
        "jerk limits 160 rad/s3, 40 m/s3 (full acceleration in 0.05 s)",
        "no friction at j2",
        "no rotor inertia",
        "a controller period of 4 ms",
        "gravity 9.81 m/s2 along -z of link base",
    ):
        assert part in text


def test_stated_limits_are_not_called_assumed(write_urdf):
    """Acceleration and jerk limits that the file states are none of the assumptions."""
    with pytest.warns(AssumedValueWarning, match="assumed, because") as caught:
        load_robot(write_urdf(limited(acceleration="2", jerk="30")))
    assert "limits" not in str(caught[0].message).partition("assumed")[2]
