"""A calibrated robot as URDF and MJCF, with corrected origins of its joints."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import yaml

from estimation.calibrations.result import Calibration
from estimation.exports.mjcf.contents import Contents
from estimation.exports.mjcf.new_model import new_model
from estimation.exports.urdf import inertial_element, joint_element, numbers, roll_pitch_yaw
from robots.common.arrays import Array
from robots.common.config import read_config
from robots.description import RobotDescription, Same
from robots.geometry.chain import Joint
from robots.geometry.xacro_ import urdf_bytes
from robots.geometry_errors.terms import error_term
from robots.loading import CATALOG, catalogue
from robots.robot import Robot
from robots.version import VERSION

Element = ElementTree.Element

UNKNOWN_MASS = 1e-3  # kg; a simulator needs a mass for each body that moves


def calibrated_urdf(calibration: Calibration) -> str:
    """Writes the URDF: the robot's own file with corrected origins, or a plain chain for a robot of another file.

    Args:
        calibration: of a robot.
    """
    robot = calibration.corrected
    root = _own_file(calibration.robot, robot) if robot.urdf else _plain_chain(robot)
    root.insert(0, ElementTree.Comment(f" {_remark(calibration)} "))
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def calibrated_mjcf(calibration: Calibration) -> str:
    """Writes the MJCF: a plain chain of bodies with corrected positions, without shapes.

    Args:
        calibration: of a robot.
    """
    robot = calibration.corrected
    zero = np.zeros(robot.n)
    inertia = np.where(np.isnan(robot.inertia[:, :1]), _small_body(robot.n), robot.inertia)
    contents = Contents(
        inertia=inertia,
        armature=np.asarray(robot.rotor_inertia),
        coulomb=np.asarray(robot.friction[:, 0]),
        damping=np.asarray(robot.friction[:, 1]),
        stiffness=zero,
        springref=zero,
    )
    root = new_model(contents, robot)
    # Files state rounded inertias that no body has; MuJoCo refuses them otherwise.
    for compiler in root.findall("compiler"):
        compiler.set("balanceinertia", "true")
    remark = _remark(calibration)
    if not robot.has_inertia:
        remark += f"; links of unknown mass have {UNKNOWN_MASS:g} kg"
    comment = ElementTree.Comment(f" {remark} ")
    comment.tail = root.text
    root.insert(0, comment)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def calibrated_yaml(calibration: Calibration, urdf: str) -> str | None:
    """Writes a robot YAML that names the calibrated URDF and keeps limits, drives and shapes; None without a YAML.

    Args:
        calibration: of a robot that was read from a YAML file or the catalogue.
        urdf: name of the calibrated URDF beside it.
    """
    origin = calibration.robot.origin
    path = CATALOG / f"{origin}.yaml" if origin in catalogue() else Path(origin)
    if path.suffix.lower() not in (".yaml", ".yml") or not path.is_file():
        return None
    text = read_config(path, RobotDescription).model_dump(exclude_unset=True)
    own_file = text.get("urdf") is not None
    for key in ("geometry", "base", "flange", "mjcf", *(() if own_file else ("tip", "joints", "locked"))):
        text.pop(key, None)
    text.get("dynamics", {}).pop("links", None)
    text["urdf"] = urdf
    if own_file:
        text["joints"] = list(calibration.robot.joint_names)
    return f"# {_remark(calibration)}\n" + yaml.safe_dump(_plain(text), sort_keys=False, default_flow_style=None)


def _plain(value: Any) -> Any:
    """Lists and numbers of YAML's own types."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    # One value for all joints is kept as a list of its own type.
    if isinstance(value, Same):
        return float(value[0])
    return [_plain(item) for item in value] if isinstance(value, list | tuple) else value


def _remark(calibration: Calibration) -> str:
    """What the file states, and which errors it cannot."""
    left = [error_term(kind).title for kind in calibration.kinds if not error_term(kind).constant]
    stated = f"geometry calibrated by robot-oed {VERSION}; the joint zeros are in the origins"
    # Two hyphens end a comment.
    return (stated + (f"; not stated: {', '.join(left)}" if left else "")).replace("--", "-")


def _own_file(nominal: Robot, robot: Robot) -> Element:
    root = ElementTree.fromstring(urdf_bytes(robot.urdf))
    elements = {joint.get("name"): joint for joint in root.findall("joint")}
    places = {place.name: place for place in nominal.links}
    for joint in robot.chain.joints:
        element = elements[joint.name]
        parent = element.find("parent")
        assert parent is not None
        # The chain's placement counts from the body; the file's origin from the link that carries the joint.
        pose = np.linalg.inv(places[str(parent.get("link"))].pose) @ joint.placement
        for origin in element.findall("origin"):
            element.remove(origin)
        values = {"xyz": numbers(pose[:3, 3]), "rpy": numbers(roll_pitch_yaw(pose[:3, :3]))}
        element.insert(0, Element("origin", values))
    return root


def _plain_chain(robot: Robot) -> Element:
    root, limits = Element("robot", name=robot.name), robot.limits
    ElementTree.SubElement(root, "link", name="base")
    for i, joint in enumerate(robot.chain.joints):
        link = ElementTree.SubElement(root, "link", name=f"link_{i + 1}")
        if np.isfinite(robot.inertia[i]).all() and robot.inertia[i, 0] > 0.0:
            link.append(inertial_element(robot.inertia[i]))
        bounds = (limits.lower[i], limits.upper[i], limits.velocity[i], limits.torque[i])
        root.append(joint_element(joint, f"link_{i}" if i else "base", f"link_{i + 1}", bounds))
    tip = Joint("flange_joint", "revolute", robot.chain.tip[:3, :3], robot.chain.tip[:3, 3])
    ElementTree.SubElement(root, "link", name="flange")
    fixed = joint_element(tip, f"link_{robot.n}", "flange", (-np.inf, np.inf, np.inf, np.inf))
    fixed.set("type", "fixed")
    for axis in fixed.findall("axis"):
        fixed.remove(axis)
    root.append(fixed)
    return root


def _small_body(n: int) -> Array:
    body = np.zeros((n, 10))
    body[:, 0] = UNKNOWN_MASS
    body[:, [4, 7, 9]] = 1e-6
    return body
