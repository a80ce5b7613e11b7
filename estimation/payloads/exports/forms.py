"""Payloads as controllers and descriptions take them: a body as their text, one class a form."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from typing import ClassVar
from xml.etree import ElementTree

import numpy as np

from estimation.payloads.body import Body
from robots.common.arrays import Array


class PayloadExport(ABC):
    """A form in which controllers or descriptions take a payload.

    Attributes:
        name: as the command line spells it.
        file: name of the file.
        title: what it is, for people.
    """

    name: ClassVar[str]
    file: ClassVar[str]
    title: ClassVar[str]

    @abstractmethod
    def text(self, body: Body, title: str) -> str:
        """Writes a body.

        Args:
            body: that can exist, in the frame of the controller's flange.
            title: one line about where it comes from.

        Returns:
            The file's text.
        """


def number(value: float) -> str:
    """Writes a number with nine digits, a point, and without an exponent, which controllers may not read."""
    return np.format_float_positional(float(value), precision=9, unique=False, fractional=False, trim="0")


class Franka(PayloadExport):
    """``endeffector-config.json`` of an end effector archive.

    Mass [kg]; centre of mass (3) in the flange frame [m]; inertia (9) [kg m2], a column-major 3 x 3 matrix; the end
    effector's frame in the flange frame (16), a column-major 4 x 4 matrix, here the identity
    (https://download.franka.de/ride-cli-doc-v1.1.1/end_effector_commissioning.html). The inertia is about the centre of
    mass (libfranka, ``RobotState::I_ee``,
    https://docs.ros.org/en/humble/p/libfranka/generated/structfranka_1_1RobotState.html). ``Robot::setLoad`` takes the
    same three quantities.
    """

    name: ClassVar[str] = "franka"
    file: ClassVar[str] = "endeffector-config.json"
    title: ClassVar[str] = "end-effector configuration of Franka"

    def text(self, body: Body, title: str) -> str:
        """Writes the configuration."""
        data = {
            "id": "identified-payload",
            "name": title,
            "color": "#808080",
            "mass": body.mass,
            "centerOfMass": body.centre.tolist(),
            "transformation": np.eye(4).ravel(order="F").tolist(),
            "inertia": body.inertia.ravel(order="F").tolist(),
        }
        return json.dumps(data, indent=2, allow_nan=False) + "\n"


class Kuka(PayloadExport):
    """``LOAD_DATA[1]={M ..,CM {X ..,Y ..,Z ..,A ..,B ..,C ..},J {X ..,Y ..,Z ..}}`` for ``$config.dat``.

    Mass M [kg]; centre of mass X, Y, Z [mm] in the FLANGE frame; A, B, C [deg] turn that frame to the principal axes of
    inertia: A about Z, then B about the new Y, then C about the new X; J: principal moments of inertia about the centre
    of mass [kg m2] (KUKA, KR IONTEC, technical data, "Load center of gravity and mass moment of inertia",
    https://www.easymanua.ls/kuka/iontec-kr-20-r3100/manual?p=40; the fields of the load data:
    https://infosys.beckhoff.com/content/1033/tf5120/13081587595.html).
    """

    name: ClassVar[str] = "kuka"
    file: ClassVar[str] = "load_data.dat"
    title: ClassVar[str] = "load data of KUKA"

    def text(self, body: Body, title: str) -> str:
        """Writes the assignment."""
        moments, axes = body.principal
        pairs = [
            _fields("XYZ", 1000 * body.centre),
            _fields("ABC", np.degrees(zyx_angles(axes))),
            _fields("XYZ", moments),
        ]
        return (
            f"; {title}\n"
            "; M [kg], CM [mm] and its principal axes [deg] in the FLANGE frame, J about the centre of mass [kg m2].\n"
            "; Replace the index by the number of the tool.\n"
            f"LOAD_DATA[1]={{M {number(body.mass)},CM {{{pairs[0]},{pairs[1]}}},J {{{pairs[2]}}}}}\n"
        )


def zyx_angles(rotation: Array) -> Array:
    """Gives A, B, C (3,) [rad] with ``R = Rz(A) Ry(B) Rx(C)`` of a rotation matrix (3, 3)."""
    level = float(np.hypot(rotation[0, 0], rotation[1, 0]))
    b = np.arctan2(-rotation[2, 0], level)
    if level < 1e-9:  # A and C turn about one axis: all of it goes to A
        return np.array([np.arctan2(-rotation[0, 1], rotation[1, 1]), b, 0.0])
    return np.array([np.arctan2(rotation[1, 0], rotation[0, 0]), b, np.arctan2(rotation[2, 1], rotation[2, 2])])


def _fields(names: str, values: Array) -> str:
    return ",".join(f"{name} {number(value)}" for name, value in zip(names, values, strict=True))


class RosParameters(PayloadExport):
    """Parameters ``payload.mass``, ``payload.center_of_gravity.x`` .., ``payload.ixx`` .. for any node.

    The file has the form of ROS 2 parameter files
    (https://docs.ros.org/en/humble/How-To-Guides/Migrating-from-ROS1/Migrating-Parameters.html). The names are those of
    the service ``ur_msgs/srv/SetPayload`` (https://docs.ros.org/en/jazzy/p/ur_msgs/srv/SetPayload.html): mass [kg],
    centre of gravity [m] in the flange frame, inertia about it [kg m2] in the flange's axes.
    """

    name: ClassVar[str] = "ros"
    file: ClassVar[str] = "payload_parameters.yaml"
    title: ClassVar[str] = "parameter file of ROS 2"

    def text(self, body: Body, title: str) -> str:
        """Writes the parameters."""
        I = body.inertia  # noqa: E741
        lines = [f"# {title}", "# kg, m, kg m2; inertia about the centre of gravity, in the flange's axes"]
        lines += ["/**:", "  ros__parameters:", "    payload:", f"      mass: {number(body.mass)}"]
        lines.append("      center_of_gravity:")
        lines += [f"        {axis}: {number(value)}" for axis, value in zip("xyz", body.centre, strict=True)]
        for name in ("xx", "yy", "zz", "xy", "xz", "yz"):
            lines.append(f"      i{name}: {number(I['xyz'.index(name[0]), 'xyz'.index(name[1])])}")
        return "\n".join([*lines, ""])


class UrdfLink(PayloadExport):
    """A robot of two links, ``flange`` and ``payload``, with a fixed joint between them.

    The inertial's origin is the centre of mass [m] in the flange frame; the inertia [kg m2] is about it
    (https://docs.ros.org/en/noetic/api/urdf/html/classurdf_1_1Inertial.html, http://wiki.ros.org/urdf/XML/link).
    """

    name: ClassVar[str] = "urdf"
    file: ClassVar[str] = "payload.urdf"
    title: ClassVar[str] = "link of a URDF"

    def text(self, body: Body, title: str) -> str:
        """Writes the link and its joint; copy both, and name the robot's own flange link as the parent."""
        root = ElementTree.Element("robot", name="payload")
        root.append(ElementTree.Comment(f" {title.replace('--', '-')} "))
        root.append(ElementTree.Comment(" Copy link and joint into the robot's URDF; parent: its flange link. "))
        ElementTree.SubElement(root, "link", name="flange")
        inertial = ElementTree.SubElement(ElementTree.SubElement(root, "link", name="payload"), "inertial")
        xyz = " ".join(f"{value:.12g}" for value in body.centre)
        ElementTree.SubElement(inertial, "origin", xyz=xyz, rpy="0 0 0")
        ElementTree.SubElement(inertial, "mass", value=f"{body.mass:.12g}")
        values = {f"i{'xyz'[i]}{'xyz'[j]}": f"{body.inertia[i, j]:.12g}" for i in range(3) for j in range(i, 3)}
        ElementTree.SubElement(inertial, "inertia", values)
        joint = ElementTree.SubElement(root, "joint", name="payload_joint", type="fixed")
        ElementTree.SubElement(joint, "parent", link="flange")
        ElementTree.SubElement(joint, "child", link="payload")
        ElementTree.SubElement(joint, "origin", xyz="0 0 0", rpy="0 0 0")
        ElementTree.indent(root)
        return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


class UrScript(PayloadExport):
    """``set_target_payload(m, cog, inertia)``.

    Mass [kg]; centre of gravity ``[x, y, z]`` from the tool mount [m]; inertia ``[Ixx, Iyy, Izz, Ixy, Ixz, Iyz]``
    [kg m2] about the centre of gravity, its axes those of the tool flange (Universal Robots, script manual,
    https://www.universal-robots.com/manuals/EN/HTML/SW10_6/Content/prod-scriptmanual/G5/set_target_payload.htm).
    Controllers before that function take ``set_payload(m, cog)``, which stands in a comment.
    """

    name: ClassVar[str] = "urscript"
    file: ClassVar[str] = "payload.script"
    title: ClassVar[str] = "URScript of Universal Robots"

    def text(self, body: Body, title: str) -> str:
        """Writes the call."""
        centre, I = body.centre, body.inertia  # noqa: E741
        cog = ", ".join(map(number, centre))
        inertia = ", ".join(map(number, (I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2])))
        mass = number(body.mass)
        return (
            f"# {title}\n"
            "# Mass [kg]; centre of gravity [m] in the flange frame; inertia about it [kg m2]: xx yy zz xy xz yz.\n"
            f"# Older controllers: set_payload({mass}, [{cog}])\n"
            f"set_target_payload({mass}, [{cog}], [{inertia}])\n"
        )
