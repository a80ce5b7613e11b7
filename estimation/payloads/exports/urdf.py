"""URDF: a link with the payload's inertial, fixed to the flange."""

from __future__ import annotations

from typing import ClassVar
from xml.etree import ElementTree

from estimation.payloads.body import Body
from estimation.payloads.exports.base import PayloadExport


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
