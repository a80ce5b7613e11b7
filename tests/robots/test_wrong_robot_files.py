"""Robots that cannot be loaded, and what is said of them."""

from __future__ import annotations

import pytest

from robots.common.errors import InputError
from robots.loading import load_robot
from tests.robots.robot_files import TABLE


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ("er3b", "unknown robot 'er3b'; allowed: er3a, .*ur10.*, or the path of .*; did you mean 'er3a'"),
        ("UR-10", "did you mean 'ur10'"),
        ("", "unknown robot ''"),
        ("missing.urdf", "missing.urdf: no such file"),
        ("missing.yaml", "missing.yaml: no such file"),
        ("robot.urdf.xacro", "robot.urdf.xacro: no such file"),
    ],
)
def test_a_robot_that_does_not_exist_is_refused(spec, message):
    """An unknown name is answered with the catalogue and the nearest name, a missing file by its name."""
    with pytest.raises(InputError, match=message):
        load_robot(spec)


def test_a_file_of_another_kind_is_refused(tmp_path):
    """A file that is no robot by its suffix, and a folder, are refused with the suffixes allowed."""
    path = tmp_path / "robot.txt"
    path.write_text("hello")
    with pytest.raises(
        InputError,
        match=r"robot\.txt: the file name does not end like that of a robot file; "
        r"allowed: \.urdf, \.xacro, \.xml \(MJCF\), \.yaml or \.yml",
    ):
        load_robot(path)
    with pytest.raises(InputError, match="the file name does not end like that of a robot file"):
        load_robot(tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "column", "message"),
    [
        ("name: pair", "title: pair", "name", "the key 'name' is missing"),
        (
            "alpha: 90",
            "alhpa: 90",
            "geometry.joints[1].alhpa",
            "unknown key 'alhpa'; allowed: .*; did you mean 'alpha'",
        ),
        ("alpha: 90", "alpha: ninety", "geometry.joints[1].alpha", "found 'ninety'"),
        ("alpha: 90", "alpha: .nan", "geometry.joints[1].alpha", "found nan"),
        ("standard", "craig", "geometry.convention", "found 'craig'; allowed: 'modified' or 'standard'"),
        ("kind: prismatic", "kind: helical", "geometry.joints[2].kind", "found 'helical'"),
        ("angles: deg", "angles: 5", "geometry.angles", "found 5"),
        ("values: [180, .inf]", "values: [180]", "limits.velocity.values", "1 values; allowed: 2, one per joint"),
        ("lower: [-90, -100]", "lower: [-90]", "limits.position.lower", "1 values"),
        ("lower: [-90, -100]", "lower: [-90, 200]", "limits.position", "joint 2: lower 0.2 is not below upper 0.1"),
        (
            "[deg/s, m/s]",
            "[deg/s, deg/s]",
            "limits.velocity.unit",
            "joint 2: the unit 'deg/s' of a velocity; allowed: m/s",
        ),
        ("[deg/s, m/s]", "rpm", "limits.velocity.unit", "joint 1: the unit 'rpm'"),
        ("[deg/s, m/s]", "[deg/s]", "limits.velocity.unit", "1 units; allowed: one, or 2"),
        ("gear_ratio: {values: [100, 20]}", "", "dynamics.drives", "the gear_ratio needed to convert it is missing"),
        ("[100, 20]", "[0, 20]", None, "gear_ratio is 0.0"),
        ("[1e-5, 2E-5]", "[1e-5, -2E-5]", None, "joint 2: pair: rotor_inertia is"),
        ("mass: 2", "mass: -2", None, r"dynamics\.links\[1\] has a mass of -2 kg"),
        ("mass: 2, ", "", "dynamics.links[1].mass", "the key 'mass' is missing"),
        ("com: [-0.25, 0, 0]", "com: [0, 0]", "dynamics.links[1].com", "found a list; list should have at least 3"),
        (
            "    - {mass: 1, com: [0, 0, 0], inertia_at_com: [0.01, 0, 0, 0.01, 0, 0.01]}\n",
            "",
            "dynamics.links",
            "1 links",
        ),
        ("name: pair", "name: pair\ntip: hand", None, "do not apply to 'geometry'"),
        ("name: pair", "name: pair\nurdf: a.urdf", None, "one of 'geometry', 'urdf' and 'mjcf'"),
        ("name: pair", "name: pair\nperiod: 0", "period", "greater than 0"),
        ("name: pair", "name: pair\nperiod: true", "period", "found True"),
        ("name: pair", "name: pair\nname: two", "name", "row 2: the key appears twice"),
    ],
)
def test_a_wrong_yaml_is_refused(old, new, column, message, write):
    """A robot file with an error is refused, naming the file, the key by its path, and what is allowed."""
    assert old in TABLE
    path = write(TABLE.replace(old, new, 1))
    with pytest.raises(InputError, match=message) as caught:
        load_robot(path)
    if column is not None:
        assert caught.value.column == column
        assert caught.value.file == str(path)


def test_a_choice_of_joints_needs_a_urdf(write):
    """A table has no joints to choose from."""
    with pytest.raises(InputError, match="tip, joints and locked do not apply"):
        load_robot(write(TABLE), joints=["J1"])


def test_a_urdf_states_its_own_links(urdf, write):
    """A file that names a URDF may not state links beside it, and the URDF must exist."""
    with pytest.raises(InputError, match="a URDF or MJCF contains them"):
        load_robot(write("name: x\nurdf: two.urdf\nbase: {xyz: [0, 0, 1]}\n"))
    with pytest.raises(InputError, match=r"three\.urdf: no such file"):
        load_robot(write("name: x\nurdf: three.urdf\n"))
