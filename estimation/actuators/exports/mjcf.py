"""Identified drives as an MJCF: the robot's own file with new joints and actuators, or a plain chain."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from estimation.actuators.exports.expressible import Expressible, expressible
from estimation.actuators.result import Actuators
from estimation.exports.mjcf.contents import Contents
from estimation.exports.mjcf.editing import FRICTION_TIME_STEPS, Source, keep_assets, read_source, set_inertial
from estimation.exports.mjcf.new_model import new_model
from estimation.exports.mjcf.xml_elements import inertial, numbers
from robots.common.errors import InputError
from robots.geometry.inertia import inertial_parameters
from robots.mujoco_models.elements import pose
from robots.robot import Robot
from robots.version import VERSION

Element = ElementTree.Element

NEW_STEP = 5e-4
"""Time step [s] of a file that had none, see `estimation.exports.mjcf.new_model`."""


class DrivesMjcf(NamedTuple):
    """A written MJCF: its text, and what it does not state."""

    text: str
    remarks: tuple[str, ...]


def drives_mjcf(result: Actuators, folder: Path) -> DrivesMjcf:
    """Writes armature, damping, frictionloss and position actuators with limits, offsets and delays.

    If the robot came from an MJCF, its file is kept; only moving joints and their actuators change, and links whose
    mass was identified. Any other serial robot gets a plain chain.

    Args:
        result: identified drives, as `identify_actuators` returned them.
        folder: into which the text will be written, for paths of meshes.

    Raises:
        InputError: a loaded result, which has no robot; or a URDF that branches.
    """
    if not result.robots:
        raise InputError("a loaded result has no robot to write an MJCF of", remedy="identify the drives again")
    known = expressible(result)
    path = Path(result.robots[0].mjcf)
    remarks = list(known.left_out)
    if result.robots[0].mjcf and path.is_file():
        root, step, delays = _edited(read_source(path), result, known, folder)
    elif len(result.robots) == 1:
        root, step, delays = _new(result.robots[0], known), NEW_STEP, True
    else:
        raise InputError(
            "no MJCF of a URDF that branches",
            remedy="convert the URDF with MuJoCo, and identify with that MJCF",
        )
    _actuators(root, result, known, step, delays)
    if np.any(known.delay > 0) and not delays:
        remarks.append("delays: this version of MuJoCo has none")
    if any(law in ("velocity", "cascade") for law in result.law):
        remarks.append("cascades are written as PD control without the integral part")
    said = "; ".join([f"drives identified by robot-oed {VERSION}", *remarks]).replace("--", "-")
    root.insert(0, ElementTree.Comment(f" {said} "))
    ElementTree.indent(root)
    return DrivesMjcf(ElementTree.tostring(root, encoding="unicode") + "\n", tuple(remarks))


def _edited(source: Source, result: Actuators, known: Expressible, folder: Path) -> tuple[Element, float, bool]:
    step = float(source.model.opt.timestep)
    for j, name in enumerate(result.joints):
        if name not in source.joints:
            raise InputError(f"the joint {name!r} is not in the text of the file", file=source.path)
        element = source.joints[name]
        element.set("armature", repr(float(known.armature[j])))
        element.set("damping", repr(float(known.damping[j])))
        element.set("frictionloss", repr(float(known.friction[j])))
        if known.friction[j] > 0:
            # MuJoCo's default lets a joint creep that friction should hold.
            element.set("solreffriction", f"{FRICTION_TIME_STEPS * step!r} 1")
        if known.mass_factor[j] != 1.0:
            _scale_body(source, name, float(known.mass_factor[j]))
    keep_assets(source, folder)
    return source.root, step, hasattr(source.model, "actuator_delay")


def _scale_body(source: Source, joint: str, factor: float) -> None:
    number = source.names.joints.index(joint)
    body = int(source.model.jnt_bodyid[number])
    at = pose(source.model.body_ipos[body], source.model.body_iquat[body])
    moments = np.diag(source.model.body_inertia[body])
    own = inertial_parameters(float(source.model.body_mass[body]), np.zeros(3), moments, at)
    set_inertial(source.bodies[source.names.bodies[body]], inertial(factor * own))


def _new(robot: Robot, known: Expressible) -> Element:
    zero = np.zeros(robot.n)
    contents = Contents(
        inertia=known.mass_factor[:, None] * np.asarray(robot.inertia),
        armature=known.armature,
        coulomb=known.friction,
        damping=known.damping,
        stiffness=zero,
        springref=zero,
    )
    return new_model(contents, robot)


def _actuators(root: Element, result: Actuators, known: Expressible, step: float, delays: bool) -> None:
    """Replaces the joints' actuators by general ones of the form of a position servo."""
    names = set(result.joints)
    called: dict[str, str] = {}
    for section in root.findall("actuator"):
        for element in list(section):
            if element.get("joint") in names:
                called.setdefault(str(element.get("joint")), element.get("name") or str(element.get("joint")))
                section.remove(element)
    found = root.find("actuator")
    section = ElementTree.SubElement(root, "actuator") if found is None else found
    for j, name in enumerate(result.joints):
        element = ElementTree.SubElement(
            section,
            "general",
            name=called.get(name, name),
            joint=name,
            gaintype="fixed",
            biastype="affine",
            gainprm=numbers([known.kp[j]]),
            biasprm=numbers([-known.offset[j], -known.kp[j], -known.kd[j]]),
            ctrllimited="false",
            forcelimited="false",
        )
        if np.isfinite(known.limit[j]):
            element.set("forcelimited", "true")
            element.set("forcerange", numbers([-known.limit[j], known.limit[j]]))
        if delays and known.delay[j] > 0:
            element.set("delay", repr(float(known.delay[j])))
            element.set("nsample", str(int(np.ceil(known.delay[j] / step)) + 1))
            element.set("interp", "zoh")
