"""Boxes about a robot's links, where its URDF draws them with primitive shapes."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.geometry.urdf import UrdfTree, read_urdf
from robots.geometry.urdf_reader import UrdfReader
from robots.geometry.xacro_ import is_description, urdf_bytes
from robots.robot import Robot

Box = tuple[Array, Array]


def link_boxes(robot: Robot) -> dict[int, Box]:
    """Finds the axis-aligned box about each link's collision shapes (visual ones where it has none).

    A link counts only if all shapes rigidly attached to it are boxes, cylinders and spheres. The file does not state
    the extent of a mesh, and the pose of a branch behind a locked joint is unknown here.

    Args:
        robot: a robot that was read from a URDF; any other gives no boxes.

    Returns:
        Link, counted from 1, to its lowest and highest corner in the link's frame, (3,) [m].
    """
    path = robot.origin
    if not is_description(path):
        return {}
    try:
        tree = read_urdf(path)
        shapes = _shapes(path)
    except (InputError, OSError, ElementTree.ParseError):
        return {}  # the file has moved since the robot was read
    boxes = {}
    for index, name in enumerate(robot.joint_names, start=1):
        if name in tree.joints:
            corners = _corners(tree, shapes, tree.joints[name].child, np.eye(4), set(robot.joint_names))
            if corners is not None and len(corners):
                boxes[index] = (corners.min(axis=0), corners.max(axis=0))
    return boxes


def _corners(tree: UrdfTree, shapes: dict[str, Array | None], name: str, pose: Array, moving: set[str]) -> Array | None:
    """Corners (k, 3) of the shapes of a link and of what is fixed to it; None where some are not known."""
    own = shapes.get(name, np.zeros((0, 3)))
    if own is None or (len(own) == 0 and tree.links[name].mass > 0):
        return None
    found = [own @ pose[:3, :3].T + pose[:3, 3]]
    for joint in tree.child_joints[name]:
        if joint.name in moving:
            continue
        if joint.moves:
            return None
        further = _corners(tree, shapes, joint.child, pose @ joint.placement, moving)
        if further is None:
            return None
        found.append(further)
    return np.concatenate(found)


def _shapes(path: str) -> dict[str, Array | None]:
    """Corners (k, 3) about each link's shapes in its own frame; None where one is a mesh or cannot be read."""
    root = ElementTree.fromstring(urdf_bytes(path))
    shapes: dict[str, Array | None] = {}
    for link in root.findall("link"):
        drawn = link.findall("collision") or link.findall("visual")
        parts = [_shape(element) for element in drawn]
        known = [part for part in parts if part is not None]
        whole = len(known) == len(parts)
        shapes[link.get("name", "")] = np.concatenate([np.zeros((0, 3)), *known]) if whole else None
    return shapes


def _shape(element: ElementTree.Element) -> Array | None:
    box, cylinder, sphere = (element.find(f"geometry/{kind}") for kind in ("box", "cylinder", "sphere"))
    try:
        if box is not None:
            half = np.array([float(word) for word in box.get("size", "").split()]) / 2
        elif cylinder is not None:
            radius, length = float(cylinder.get("radius", "")), float(cylinder.get("length", ""))
            half = np.array([radius, radius, length / 2])
        elif sphere is not None:
            half = np.full(3, float(sphere.get("radius", "")))
        else:
            return None
        if half.shape != (3,):
            return None
        pose = UrdfReader("", "shape").placement(element)
    except (ValueError, InputError):
        return None
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    return np.asarray((signs * half) @ pose[:3, :3].T + pose[:3, 3])
