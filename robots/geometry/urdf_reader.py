"""Numbers, poses and names in the elements of a URDF, with errors that name the link or joint."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.geometry.chain import homogeneous, rotation_from_quaternion, rotation_from_rpy


class UrdfReader:
    """Reads the values of one element.

    Args:
        file: the file, for messages.
        what: the link or joint, for messages.
        joint: the joint's name, if it is one.
    """

    def __init__(self, file: str, what: str, joint: str | None = None) -> None:
        self.file, self.what, self.joint = file, what, joint

    def error(self, problem: str, allowed: str | None = None, remedy: str | None = None) -> InputError:
        """Makes an error that names the link or joint."""
        prefix = "" if self.joint is not None else f"{self.what}: "
        return InputError(prefix + problem, file=self.file, joint=self.joint, allowed=allowed, remedy=remedy)

    def child(self, parent: ElementTree.Element, tag: str) -> ElementTree.Element | None:
        """Finds the first child of a name, as other readers do; None if there is none.

        Raises:
            InputError: two of them, except of a placement; which one counts is not defined.
        """
        found = parent.findall(tag)
        if len(found) > 1 and tag != "origin":
            raise self.error(f"{len(found)} <{tag}> elements", allowed="one", remedy="remove the others")
        return found[0] if found else None

    def numbers(self, element: ElementTree.Element, key: str, count: int, default: str | None = None) -> Array:
        """Reads an attribute of finite numbers, (count,).

        Raises:
            InputError: a missing attribute without a default, or something else than that many numbers.
        """
        text = element.get(key, default)
        place = f"<{element.tag}> {key}"
        if text is None:
            raise self.error(f"{place} is missing")
        try:
            values = np.array([float(word) for word in text.split()])
        except ValueError as error:
            raise self.error(f"{place} is {text!r}", allowed=f"{count} number(s)") from error
        if values.shape != (count,) or not np.isfinite(values).all():
            raise self.error(f"{place} is {text!r}", allowed=f"{count} finite number(s)")
        return values

    def number(self, element: ElementTree.Element, key: str, default: str | None = None) -> float:
        """Reads an attribute of one finite number."""
        return float(self.numbers(element, key, 1, default)[0])

    def optional(self, element: ElementTree.Element | None, key: str) -> float | None:
        """Reads one finite number, None where the element or its attribute is missing."""
        return None if element is None or key not in element.attrib else self.number(element, key)

    def positive(self, element: ElementTree.Element | None, key: str) -> float | None:
        """Reads one number of zero or more, None where it is missing.

        Raises:
            InputError: a negative number.
        """
        value = self.optional(element, key)
        if value is not None and value < 0.0:
            assert element is not None
            raise self.error(f"<{element.tag}> {key} is {value:g}", allowed="zero or more")
        return value

    def placement(self, parent: ElementTree.Element) -> Array:
        """Reads the ``<origin>`` of an element: a shift, and a rotation as ``rpy`` or ``quat_xyzw`` (URDF 1.1).

        Returns:
            (4, 4); the identity where there is none.

        Raises:
            InputError: both kinds of rotation, or a quaternion that is not of unit length.
        """
        origin = self.child(parent, "origin")
        if origin is None:
            return np.eye(4)
        xyz = self.numbers(origin, "xyz", 3, "0 0 0")
        if "quat_xyzw" not in origin.attrib:
            return homogeneous(rotation_from_rpy(self.numbers(origin, "rpy", 3, "0 0 0")), xyz)
        if "rpy" in origin.attrib:
            raise self.error("<origin> states both rpy and quat_xyzw", allowed="one of them", remedy="remove the other")
        quaternion = self.numbers(origin, "quat_xyzw", 4)
        length = float(np.linalg.norm(quaternion))
        # A quaternion written with two digits is off by less than 5 %; one that is farther off is another thing.
        if abs(length - 1.0) > 0.05:
            raise self.error(f"<origin> quat_xyzw has the length {length:.3g}", allowed="a unit quaternion x y z w")
        return homogeneous(rotation_from_quaternion(quaternion), xyz)

    def reference(self, joint: ElementTree.Element, key: str) -> str:
        """Reads the link that ``<parent>`` or ``<child>`` names."""
        element = self.child(joint, key)
        name = "" if element is None else element.get("link", "")
        if not name:
            raise self.error(f"<{key} link=...> is missing")
        return name
