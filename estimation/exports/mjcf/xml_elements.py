"""MJCF elements from numbers."""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from estimation.exports.mjcf.couplings import Coupling
from robots.common.arrays import Array
from robots.geometry.inertia import symmetric

Element = ElementTree.Element


def numbers(values: Iterable[float]) -> str:
    """Writes numbers with all their digits."""
    return " ".join(repr(float(value)) for value in values)


def quaternion(rotation: Array) -> str:
    """Writes a rotation (3, 3) as MuJoCo's quaternion w, x, y, z."""
    return numbers(np.roll(Rotation.from_matrix(rotation).as_quat(), 1))


def inertial(parameters: Array) -> Element:
    """Builds ``<inertial>`` with principal axes.

    MuJoCo finds the principal axes of a ``fullinertia`` to six digits only.

    Args:
        parameters: (10,) in the body's frame.
    """
    mass = float(parameters[0])
    centre = parameters[1:4] / mass
    about = symmetric(parameters[4:]) - mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    moments, axes = np.linalg.eigh(about)
    axes[:, 2] *= np.linalg.det(axes)
    return Element(
        "inertial",
        pos=numbers(centre),
        mass=repr(mass),
        # Rounding must not make a point mass's moments negative.
        diaginertia=numbers(np.maximum(moments, 0.0)),
        quat=quaternion(axes),
    )


def no_inertial() -> Element:
    """Builds the ``<inertial>`` of a body whose mass another one has."""
    return Element("inertial", pos="0 0 0", mass="0", diaginertia="0 0 0")


def payload_body(parameters: Array, flange: Array) -> Element:
    """Builds the body of a payload.

    Args:
        parameters: (10,) in the flange's frame.
        flange: (4, 4) in the frame of the body that carries it.
    """
    body = Element("body", name="identified_payload", pos=numbers(flange[:3, 3]), quat=quaternion(flange[:3, :3]))
    body.append(inertial(parameters))
    return body


def tendons(couplings: Iterable[Coupling], names: tuple[str, ...], with_armature: bool) -> list[Element]:
    """Builds the tendons of couplings.

    Args:
        couplings: of neighbouring joints.
        names: of the joints.
        with_armature: whether this MuJoCo knows the armature of tendons.
    """
    elements = []
    for coupling in couplings:
        for number, tendon in enumerate(coupling.tendons, start=1):
            element = Element("fixed", name=f"identified_coupling_{coupling.inner + 1}_{number}")
            for key in ("damping", "armature", "frictionloss"):
                value = getattr(tendon, key)
                if value and (with_armature or key != "armature"):
                    element.set(key, repr(float(value)))
            for joint, coefficient in ((coupling.inner, 1.0), (coupling.inner + 1, tendon.way)):
                ElementTree.SubElement(element, "joint", joint=names[joint], coef=repr(coefficient))
            elements.append(element)
    return elements


def insert(parent: Element, place: int, child: Element) -> None:
    """Inserts an element on a line of its own, indented as its neighbours.

    Args:
        parent: the element to insert it in.
        place: before the child of this number.
        child: the new element; elements in it stay on its line.
    """
    indent = parent.text if parent.text and not parent.text.strip() else None
    if place > 0:
        child.tail = parent[place - 1].tail
        parent[place - 1].tail = indent or parent[place - 1].tail
    else:
        child.tail = indent
    parent.insert(place, child)
