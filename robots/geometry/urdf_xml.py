"""Reading the links and joints of a URDF file, one element at a time."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, get_args
from xml.etree import ElementTree

import numpy as np

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.geometry.chain import Kind
from robots.geometry.inertia import symmetric
from robots.geometry.urdf_limits import UrdfLimit, read_limit
from robots.geometry.urdf_reader import UrdfReader
from robots.geometry.urdf_schema import unused_parts
from robots.geometry.xacro_ import split_arguments, urdf_bytes

JointType = Literal["revolute", "continuous", "prismatic", "fixed", "floating", "planar"]

# Elements whose values are used here; meshes and plugins are ignored.
_KINEMATIC = frozenset(
    ("link", "joint", "origin", "axis", "limit", "mass", "inertia", "parent", "child", "mimic", "dynamics")
)
_EXPAND = "expand it first: xacro FILE.xacro > FILE.urdf, or name it .xacro"


@dataclass(frozen=True, kw_only=True, eq=False)
class UrdfLink:
    """A link: mass [kg], centre of mass [m] and inertia about it [kg m2] in link axes.

    A mass of NaN is unknown: the file states none, or zero, as exporters write it for links without material.
    """

    name: str
    mass: float = np.nan
    com: Array = field(default_factory=lambda: np.zeros(3))
    inertia_at_com: Array = field(default_factory=lambda: np.zeros((3, 3)))


@dataclass(frozen=True, kw_only=True, eq=False)
class UrdfJoint:
    """A joint of any type; ``placement`` is the (4, 4) pose of the joint frame in the parent link's frame."""

    name: str
    type: JointType
    parent: str
    child: str
    placement: Array
    axis: Array
    limit: UrdfLimit | None
    damping: float
    friction: float
    mimic: tuple[str, float, float] | None  # (joint, multiplier, offset)
    rest: float = 0.0  # position of a locked joint for which none is stated [rad or m]

    @property
    def moves(self) -> bool:
        """Whether the joint is anything but fixed."""
        return self.type != "fixed"

    @property
    def kind(self) -> Kind:
        """The kind of motion; only for a joint that moves."""
        return "prismatic" if self.type == "prismatic" else "revolute"


@dataclass(frozen=True, kw_only=True, eq=False)
class UrdfElements:
    """What a URDF file states, in its order, and the SHA-256 of its bytes.

    ``unused`` lists elements and attributes that are not read, with where or how often they occur.
    """

    file: str
    name: str
    links: tuple[UrdfLink, ...]
    joints: tuple[UrdfJoint, ...]
    digest: str
    unused: tuple[str, ...] = ()


def _link(element: ElementTree.Element, file: str) -> UrdfLink:
    name = element.get("name", "")
    if not name:
        raise InputError("a <link> has no name", file=file)
    read = UrdfReader(file, f"link {name!r}")
    inertial = read.child(element, "inertial")
    if inertial is None:
        return UrdfLink(name=name)
    mass_element, inertia_element = read.child(inertial, "mass"), read.child(inertial, "inertia")
    mass = np.nan if mass_element is None else read.number(mass_element, "value")
    # Without <inertia> it is a point mass: cameras and fingers often have only a mass.
    keys = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    six = [0.0 if inertia_element is None else read.number(inertia_element, key) for key in keys]
    pose = read.placement(inertial)
    rotation = pose[:3, :3]
    inertia = rotation @ symmetric(six) @ rotation.T
    if mass < 0.0:
        raise read.error(f"a mass of {mass:g} kg", allowed="zero or more")
    return UrdfLink(name=name, mass=mass or np.nan, com=pose[:3, 3], inertia_at_com=inertia)


def _joint(element: ElementTree.Element, file: str) -> UrdfJoint:
    name = element.get("name", "")
    if not name:
        raise InputError("a <joint> has no name", file=file)
    read = UrdfReader(file, f"joint {name!r}", name)
    type_ = element.get("type", "")
    if type_ not in get_args(JointType):
        raise read.error(f"unknown joint type {type_!r}", allowed="revolute, continuous, prismatic or fixed")
    if type_ in ("floating", "planar"):
        raise read.error(
            f"a {type_} joint moves in more than one direction",
            allowed="revolute, continuous, prismatic or fixed",
            remedy="make it fixed: a robot here stands on a fixed base",
        )
    axis = np.array([1.0, 0.0, 0.0])
    axis_element = read.child(element, "axis")
    if axis_element is not None and type_ != "fixed":
        axis = read.numbers(axis_element, "xyz", 3)
        length = np.linalg.norm(axis)
        if length < 1e-9:
            raise read.error("the axis has no length", allowed="a vector other than zero")
        axis = axis / length
    dynamics, mimic_element = read.child(element, "dynamics"), read.child(element, "mimic")
    mimic = None
    if mimic_element is not None and type_ != "fixed":
        leader = mimic_element.get("joint", "")
        mimic = (leader, read.number(mimic_element, "multiplier", "1"), read.number(mimic_element, "offset", "0"))
    return UrdfJoint(
        name=name,
        type=type_,  # type: ignore[arg-type]
        parent=read.reference(element, "parent"),
        child=read.reference(element, "child"),
        placement=read.placement(element),
        axis=axis,
        limit=None if type_ == "fixed" else read_limit(element, read),
        damping=read.positive(dynamics, "damping") or 0.0,
        friction=read.positive(dynamics, "friction") or 0.0,
        mimic=mimic,
    )


def _parse(content: bytes, file: str) -> ElementTree.Element:
    try:
        robot = ElementTree.fromstring(content)
    except ElementTree.ParseError as error:
        row = error.position[0]
        if b"xacro:" in content and "unbound prefix" in str(error):
            raise InputError("the file holds xacro macros", file=file, row=row, remedy=_EXPAND) from error
        raise InputError(f"not well-formed XML: {error}", file=file, row=row, kind="broken_xml") from error
    own = robot.tag.rpartition("}")[0]
    for element in robot.iter():
        # Comments have no name.
        space, _, tag = element.tag.rpartition("}") if isinstance(element.tag, str) else (own, "", "")
        if "xacro" in space or (tag in _KINEMATIC and any("${" in value for value in element.attrib.values())):
            raise InputError("the file holds xacro macros", file=file, remedy=_EXPAND)
        # An element of another name space is none of a URDF, whatever its name is.
        if space == own:
            element.tag = tag
    if robot.tag != "robot":
        raise InputError(f"the root element is <{robot.tag}>", file=file, allowed="<robot>, as in every URDF")
    return robot


def read_elements(path: str | Path) -> UrdfElements:
    """Read the links and joints of a URDF file, each on its own; nothing is said yet of how they hang together.

    Args:
        path: the file; a ``.xacro`` is expanded, with the arguments that may follow it (``FILE NAME:=VALUE``).

    Returns:
        What the file states.

    Raises:
        InputError: naming the file and the line, link or joint, when the file cannot be read, is not well-formed, is
            not yet expanded from xacro, or states something impossible.
    """
    file = str(path)
    content = urdf_bytes(path)
    robot = _parse(content, file)
    # Direct children only: <transmission> holds elements of the name <joint> that define none.
    links = tuple(_link(element, file) for element in robot.findall("link"))
    joints = tuple(_joint(element, file) for element in robot.findall("joint"))
    for what, names in (("link", [link.name for link in links]), ("joint", [joint.name for joint in joints])):
        repeated = next((name for name in names if names.count(name) > 1), None)
        if repeated is not None:
            raise InputError(f"two {what}s have the name {repeated!r}", file=file)
    digest = hashlib.sha256(content).hexdigest()
    return UrdfElements(
        file=file,
        name=robot.get("name", split_arguments(path)[0].stem),
        links=links,
        joints=joints,
        digest=digest,
        unused=unused_parts(robot),
    )
