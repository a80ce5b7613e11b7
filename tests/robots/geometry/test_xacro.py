"""Xacro files: expanded by the library, with packages found on disk, or refused with what to do."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from robots.common.errors import InputError
from robots.geometry.urdf import read_urdf
from robots.geometry.urdf_shapes import UrdfShape, mesh_file
from robots.geometry.xacro_ import find_package, split_arguments
from robots.loading import load_robot

SPACE = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
MACRO = """<xacro:macro name="arm" params="name parent reach">
<link name="${name}"><inertial><origin xyz="${reach / 2} 0 0"/><mass value="${2 * 1.5}"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
<joint name="j_${name}" type="revolute"><parent link="${parent}"/><child link="${name}"/>
<limit lower="${-pi / 2}" upper="${radians(90)}" velocity="2" effort="3"/></joint></xacro:macro>"""


@pytest.fixture
def xacro():
    """The library."""
    return pytest.importorskip("xacro")


def write(path, body, name="made"):
    """Writes a xacro file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f'<?xml version="1.0"?><robot name="{name}" {SPACE}>\n{body}\n</robot>\n')
    return path


CALL = '<link name="base"/><xacro:arm name="a" parent="base" reach="0.4"/>'


def test_macros_expand(xacro, tmp_path):
    """Macros and expressions become the bodies, limits and names of the robot."""
    robot = load_robot(write(tmp_path / "arm.urdf.xacro", MACRO + CALL))
    assert robot.joint_names == ("j_a",)
    assert robot.name == "made"
    np.testing.assert_allclose([robot.limits.lower[0], robot.limits.upper[0]], [-np.pi / 2, np.pi / 2])
    np.testing.assert_allclose(robot.inertia[0, :2], [3.0, 0.6])


def test_what_it_expands_to_is_what_counts(xacro, tmp_path):
    """The digest is that of the expanded file: the same wherever it lies, another with other arguments."""
    body = MACRO + '<xacro:arg name="reach" default="0.4"/>' + CALL.replace("0.4", "$(arg reach)")
    first, second = write(tmp_path / "a.xacro", body), write(tmp_path / "b" / "a.xacro", body)
    assert load_robot(first).digest == load_robot(second).digest
    longer = load_robot(f"{first} reach:=0.8")
    assert longer.digest != load_robot(first).digest
    np.testing.assert_allclose(longer.inertia[0, 1], 3.0 * 0.4)
    assert load_robot(longer.origin).digest == longer.digest


def test_included_files_and_packages_are_found(xacro, tmp_path):
    """$(find) finds packages above the file, beside them, and those of the environment."""
    workspace = tmp_path / "src"
    for package in ("my_arm", "folder_of_another_name"):
        (workspace / package).mkdir(parents=True)
    (workspace / "my_arm" / "package.xml").write_text("<package><name>my_arm</name></package>")
    other = workspace / "folder_of_another_name"
    (other / "package.xml").write_text("<package><name>parts</name></package>")
    write(other / "urdf" / "arm.xacro", MACRO)
    body = '<xacro:include filename="$(find parts)/urdf/arm.xacro"/>' + CALL
    top = write(workspace / "my_arm" / "urdf" / "top.xacro", body)
    assert load_robot(top).joint_names == ("j_a",)
    assert find_package("my_arm", top) == workspace / "my_arm"
    assert find_package("folder_of_another_name", top) == other


def test_a_missing_package_is_named_once(xacro, tmp_path):
    """The message names the package, what was looked for and what to do, without the library's words around it."""
    top = write(tmp_path / "my_arm" / "top.xacro", '<xacro:include filename="$(find parts)/urdf/arm.xacro"/>' + CALL)
    with pytest.raises(InputError, match="the package 'parts' was not found") as caught:
        load_robot(top)
    assert str(caught.value) == (
        f"{top}: the package 'parts' was not found: no package.xml and no folder around the file has that name; "
        "put it beside this package, with its package.xml or in a folder of that name, or set ROS_PACKAGE_PATH to the "
        "folder above it"
    )


def test_a_copied_package_is_the_one_around_the_file(xacro, tmp_path):
    """Vendors' packages are copied under other names, without package.xml: its own parts are found all the same."""
    write(tmp_path / "kr10" / "urdf" / "arm_macro.xacro", MACRO)
    body = '<xacro:include filename="$(find vendor_kr10_support)/urdf/arm_macro.xacro"/>' + CALL
    assert load_robot(write(tmp_path / "kr10" / "urdf" / "arm.xacro", body)).joint_names == ("j_a",)


def test_packages_of_other_repositories(tmp_path):
    """A workspace holds repositories, and these hold packages: one of another repository is found."""
    file = tmp_path / "src" / "cell" / "cell_description" / "urdf" / "cell.urdf"
    file.parent.mkdir(parents=True)
    arms = tmp_path / "src" / "arms" / "small"
    arms.mkdir(parents=True)
    (arms / "package.xml").write_text("<package><name>small_arm_description</name></package>")
    assert find_package("small_arm_description", file) == arms


def test_packages_of_the_environment(tmp_path, monkeypatch):
    """ROS_PACKAGE_PATH and AMENT_PREFIX_PATH name folders of packages."""
    (tmp_path / "one" / "parts").mkdir(parents=True)
    (tmp_path / "two" / "share" / "pieces").mkdir(parents=True)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "one"))
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "two"))
    file = tmp_path / "far" / "a.xacro"
    assert find_package("parts", file) == tmp_path / "one" / "parts"
    assert find_package("pieces", file) == tmp_path / "two" / "share" / "pieces"


def test_a_yaml_may_name_a_xacro(xacro, tmp_path):
    """The URDF of a robot YAML may be a xacro file with arguments."""
    body = MACRO + '<xacro:arg name="reach" default="0.4"/>' + CALL.replace("0.4", "$(arg reach)")
    write(tmp_path / "a.xacro", body)
    (tmp_path / "a.yaml").write_text('name: a\nurdf: "a.xacro reach:=1.0"\n')
    np.testing.assert_allclose(load_robot(tmp_path / "a.yaml").inertia[0, 1], 1.5)


WRONG = {
    "undefined argument": (
        MACRO + CALL.replace("0.4", "$(arg size)"),
        r"Undefined substitution argument size.*size:=VALUE",
    ),
    "undefined name": (MACRO + CALL.replace("0.4", "${size}"), r"xacro cannot expand it: name 'size' is not defined"),
    "unknown macro": (CALL, r"[Uu]nknown macro name: xacro:arm"),
    "missing file": ('<xacro:include filename="none.xacro"/>', r"none\.xacro"),
    "broken": ("<link>", r"xacro cannot expand it: mismatched tag"),
    "no argument": (MACRO + CALL.replace('reach="0.4"', ""), r"reach"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_cannot_be_expanded_is_refused(case, xacro, tmp_path):
    """Errors of xacro come as one message with the file; what is undefined, with how to define it."""
    body, message = WRONG[case]
    path = write(tmp_path / "a.xacro", body)
    with pytest.raises(InputError, match=message) as caught:
        load_robot(path)
    assert caught.value.file is not None
    assert "\n" not in str(caught.value)


def test_without_the_library_one_message_says_so(tmp_path, monkeypatch):
    """A xacro file without the library is refused with the package to install."""
    monkeypatch.setitem(sys.modules, "xacro", None)
    with pytest.raises(InputError, match=r"a\.xacro: a xacro file needs the package xacro; pip install xacro"):
        read_urdf(write(tmp_path / "a.xacro", CALL))


def test_missing_files_and_arguments_of_others(tmp_path):
    """A missing xacro file is refused by name; so are arguments of a plain URDF."""
    with pytest.raises(InputError, match=r"none\.xacro: no such file"):
        load_robot(tmp_path / "none.xacro")
    (tmp_path / "a.urdf").write_text("<robot/>")
    with pytest.raises(InputError, match="arguments size of a file that is no xacro"):
        load_robot(f"{tmp_path / 'a.urdf'} size:=1")


def test_arguments_are_distinguished_from_the_path():
    """A path may have blanks and colons; what looks like xacro's own arguments at its end are arguments."""
    assert split_arguments("my arm.xacro a:=1 b_c:=x/y") == (
        split_arguments("my arm.xacro")[0],
        {"a": "1", "b_c": "x/y"},
    )
    assert split_arguments("C:\\arms\\a.urdf")[1] == {}


@pytest.mark.parametrize(
    ("file", "found"),
    [
        ("package://vendor_arm/meshes/a.stl", True),  # by the name in package.xml
        ("package:///vendor_arm/meshes/a.stl", True),
        ("model://vendor_arm/meshes/a.stl", True),
        ("package://copy_of_the_arm/meshes/a.stl", True),  # by the folder's name
        ("package://lost_arm/meshes/a.stl", True),  # the folder above the URDF has the rest of the path
        ("package://lost_arm/meshes/b.stl", False),
        ("../meshes/a.stl", True),
    ],
)
def test_meshes_are_found(file, found, tmp_path):
    """A mesh is found by its package's name, in package.xml or of the folder, or beside the URDF."""
    package = tmp_path / "copy_of_the_arm"
    for folder in ("urdf", "meshes"):
        (package / folder).mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>vendor_arm</name></package>")
    mesh, urdf = package / "meshes" / "a.stl", package / "urdf" / "arm.urdf"
    mesh.touch()
    shape = UrdfShape(link="l", kind="mesh", pose=np.eye(4), file=file)
    if found:
        assert mesh_file(shape, urdf).resolve() == mesh.resolve()
    else:
        with pytest.raises(InputError, match="the package 'lost_arm' was not found"):
            mesh_file(shape, urdf)
