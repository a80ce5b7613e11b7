"""A plain MJCF of a robot that came from elsewhere: a chain of bodies without shapes."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from estimation.exports.mjcf.contents import Contents
from estimation.exports.mjcf.xml_elements import inertial, numbers, payload_body, quaternion, tendons
from robots.robot import Robot

Element = ElementTree.Element

TIMESTEP = 0.0005  # [s]; dry friction of small joints acts fully above some hundredths of a radian per second then


def new_model(contents: Contents, robot: Robot) -> Element:
    """Builds the file.

    Args:
        contents: the numbers.
        robot: its chain and limits.

    Returns:
        The root element, indented.
    """
    root = Element("mujoco", model=robot.name)
    ElementTree.SubElement(root, "compiler", angle="radian", autolimits="true")
    ElementTree.SubElement(root, "option", timestep=repr(TIMESTEP), gravity=numbers(robot.chain.gravity))
    body = ElementTree.SubElement(root, "worldbody")
    actuators = Element("actuator")
    limits = robot.limits
    for i, joint in enumerate(robot.chain.joints):
        body = ElementTree.SubElement(
            body, "body", name=f"link_{i + 1}", pos=numbers(joint.translation), quat=quaternion(joint.rotation)
        )
        body.append(inertial(contents.inertia[i]))
        element = ElementTree.SubElement(
            body,
            "joint",
            name=joint.name,
            type="slide" if joint.kind == "prismatic" else "hinge",
            axis=numbers(joint.axis),
            armature=repr(float(contents.armature[i])),
        )
        if contents.damping is not None and contents.coulomb is not None:
            element.set("damping", repr(float(contents.damping[i])))
            element.set("frictionloss", repr(float(contents.coulomb[i])))
            element.set("solreffriction", f"{2 * TIMESTEP!r} 1")
        if contents.stiffness[i]:
            element.set("stiffness", repr(float(contents.stiffness[i])))
            element.set("springref", repr(float(contents.springref[i])))
        if np.isfinite([limits.lower[i], limits.upper[i]]).all():
            element.set("range", numbers([limits.lower[i], limits.upper[i]]))
        motor = ElementTree.SubElement(actuators, "motor", name=f"motor_{i + 1}", joint=joint.name)
        if np.isfinite(limits.torque[i]):
            motor.set("forcerange", numbers([-limits.torque[i], limits.torque[i]]))
    if contents.payload is not None:
        body.append(payload_body(contents.payload, np.asarray(robot.chain.tip)))
    tip = np.asarray(robot.chain.tip)
    ElementTree.SubElement(body, "site", name="flange", pos=numbers(tip[:3, 3]), quat=quaternion(tip[:3, :3]))
    root.append(actuators)
    added = tendons(contents.couplings, robot.joint_names, with_armature=True)
    if added:
        ElementTree.SubElement(root, "tendon").extend(added)
    ElementTree.indent(root)
    return root
