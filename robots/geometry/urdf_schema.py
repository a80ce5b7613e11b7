"""Which elements and attributes a URDF may have, and which of a file's are not read here."""

from __future__ import annotations

from collections.abc import Iterator
from difflib import get_close_matches
from xml.etree import ElementTree

_POSE = {"origin": (("xyz", "rpy", "quat_xyzw"), ())}
# Element, then its attributes and the elements within; what is drawn or only simulated is left out.
_KNOWN: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "robot": (("name", "version"), ("link", "joint", "material")),
    "link": (("name",), ("inertial", "visual", "collision")),
    "inertial": ((), ("origin", "mass", "inertia")),
    "mass": (("value",), ()),
    "inertia": (("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), ()),
    "joint": (
        ("name", "type"),
        ("origin", "parent", "child", "axis", "limit", "dynamics", "mimic", "safety_controller", "calibration"),
    ),
    "parent": (("link",), ()),
    "child": (("link",), ()),
    "axis": (("xyz",), ()),
    "limit": (("lower", "upper", "velocity", "effort", "acceleration", "deceleration", "jerk"), ()),
    "dynamics": (("damping", "friction"), ()),
    "mimic": (("joint", "multiplier", "offset"), ()),
    "safety_controller": (("soft_lower_limit", "soft_upper_limit", "k_position", "k_velocity"), ()),
    "collision": (("name",), ("origin", "geometry")),
    "geometry": ((), ("box", "cylinder", "sphere", "capsule", "mesh")),
    "box": (("size",), ()),
    "cylinder": (("radius", "length"), ()),
    "sphere": (("radius",), ()),
    "capsule": (("radius", "length"), ()),
    "mesh": (("filename", "scale"), ()),
    **_POSE,
}
_WHOLE = ("visual", "material", "calibration")  # of no consequence for motion and torque, whatever they hold


def unused_parts(robot: ElementTree.Element) -> tuple[str, ...]:
    """Lists what a URDF states and nobody reads.

    Args:
        robot: the root element; names of foreign name spaces are still in Clark's notation.

    Returns:
        One text a kind: the element or attribute, its owners or their number, and the known name that is most similar.
    """
    found: dict[str, list[str]] = {}
    for name, owner in _unknown(robot, ""):
        found.setdefault(name, []).append(owner)
    texts = []
    for name, owners in found.items():
        named = [owner for owner in dict.fromkeys(owners) if owner]
        # Up to three owners are named, more are counted.
        where = ", ".join(named) if named and len(named) <= 3 else f"{len(owners)} times"
        texts.append(f"{name} ({where})")
    return tuple(texts)


def _unknown(element: ElementTree.Element, owner: str) -> Iterator[tuple[str, str]]:
    attributes, children = _KNOWN[element.tag]
    if element.tag in ("link", "joint"):
        owner = element.get("name", "")
    for key in element.attrib:
        if key not in attributes:
            yield f"{element.tag} {_plain(key)}{_similar(key, attributes)}", owner
    for child in element:
        if not isinstance(child.tag, str) or child.tag in _WHOLE:
            continue
        if child.tag in children:
            yield from _unknown(child, owner)
        else:
            yield f"<{_plain(child.tag)}>{_similar(child.tag, children)}", owner or child.get("name", "")


def _plain(name: str) -> str:
    """A name with the last part of its name space: ``drake:joint`` of drake.mit.edu's joint."""
    space, _, tag = name.rpartition("}")
    if not space:
        return name
    host = space.strip("{").removeprefix("http://").removeprefix("https://").strip("/")
    return f"{host}:{tag}"


def _similar(name: str, known: tuple[str, ...]) -> str:
    close = [] if name.startswith("{") else get_close_matches(name.lower(), known, n=1, cutoff=0.75)
    return f", similar to {close[0]}" if close else ""
