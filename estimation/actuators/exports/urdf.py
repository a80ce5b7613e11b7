"""Identified friction in a URDF's ``<dynamics>``."""

from __future__ import annotations

from xml.etree import ElementTree

from estimation.actuators.exports.expressible import expressible
from estimation.actuators.result import Actuators
from robots.common.errors import InputError
from robots.geometry.xacro_ import is_description, urdf_bytes
from robots.version import VERSION


def drives_urdf(result: Actuators) -> str:
    """Writes the robot's own URDF with damping and friction of its joints.

    A URDF has no rotor inertia, gains or delay: a comment lists what it leaves out.

    Args:
        result: identified drives of a robot that came from a URDF or xacro.

    Raises:
        InputError: another robot.
    """
    source = result.robots[0].origin if result.robots else ""
    if not is_description(source):
        raise InputError("the robot did not come from a URDF", remedy="take the MJCF or the table")
    known = expressible(result)
    root = ElementTree.fromstring(urdf_bytes(source))
    joints = {joint.get("name"): joint for joint in root.findall("joint")}
    for j, name in enumerate(result.joints):
        dynamics = joints[name].find("dynamics")
        if dynamics is None:
            dynamics = ElementTree.SubElement(joints[name], "dynamics")
        dynamics.set("damping", repr(float(known.damping[j])))
        dynamics.set("friction", repr(float(known.friction[j])))
    left = ["rotor inertia, gains, delays and offsets", *known.left_out]
    said = f" drives identified by robot-oed {VERSION}; a URDF cannot state: {'; '.join(left)} ".replace("--", "-")
    root.insert(0, ElementTree.Comment(said))
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"
