"""An identified model as a URDF: the robot's own file with new bodies and friction, or a new file from its chain."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from estimation.exports.feasible import NEAREST, nearest_feasible
from estimation.exports.friction import NAMED_DIFFERENCE, LinearFriction, linear_friction
from estimation.exports.remainders import remainder
from estimation.exports.standard import REMEDY, standard_parameters
from estimation.exports.unstated import unstated_terms
from estimation.models.model import Model
from robots.common.arrays import Array
from robots.common.errors import InfeasibleError, InputError, NearestBodiesWarning
from robots.common.files import write_atomic
from robots.geometry.chain import Joint
from robots.geometry.inertia import inertial_parameters, symmetric
from robots.geometry.urdf_xml import read_elements
from robots.geometry.xacro_ import is_description, split_arguments, urdf_bytes
from robots.robot import Robot
from robots.version import VERSION

Element = ElementTree.Element

EYE = np.eye(4)
# Limits that are not known: a URDF states both, velocity and effort, in finite numbers.
UNKNOWN_LIMIT = 1e9


def export_urdf(model: Model, path: str | Path, *, robot: Robot | None = None, force: bool = False) -> None:
    """Writes a URDF with the identified inertial parameters and friction.

    Args:
        model: an identified model.
        path: the file to write.
        robot: the robot as it was loaded, for its description and limits; the model's own by default, which knows its
            geometry only.
        force: whether an existing file may be replaced.

    Raises:
        InputError: an existing file without `force`, or no description to complete the base parameters with.
        InfeasibleError: no body that can exist is near to the identified base parameters.
    """
    write_atomic(Path(path), urdf_text(model, robot), force=force)


def urdf_text(model: Model, robot: Robot | None = None) -> str:
    """Writes the URDF of `export_urdf` as text.

    If the robot came from a URDF or xacro, its file is kept with its meshes; the inertials, and damping and friction of
    the moving joints change. The link that a joint moves gets the inertia that moves with it; links fixed to it lose
    theirs, and links on locked joints, such as a second arm, keep theirs. Any other robot gets a plain chain. A comment
    says what a URDF cannot state. If no bodies that can exist have the identified parameters, the nearest ones are
    written; a `NearestBodiesWarning` says how far off they are.
    """
    return build_urdf(model, robot).text


class Urdf(NamedTuple):
    """A written URDF: its text, and the remarks in its comment, what it states first and what it cannot state."""

    text: str
    remarks: tuple[str, ...]

    def lines(self) -> list[str]:
        """Writes the remarks, one a line."""
        return [f"the URDF states {self.remarks[0]}", *(f"  {remark}" for remark in self.remarks[1:])]


def build_urdf(model: Model, robot: Robot | None = None) -> Urdf:
    """Writes a URDF as `urdf_text` does, and says what it states."""
    known = robot or model.robot
    described = np.asarray(known.inertia, dtype=float)
    moved = 0.0
    try:
        inertia = standard_parameters(model, described)
    except InfeasibleError:
        # A URDF has no rotors: what belongs to a rotor and a link together is the link's.
        model, moved = nearest_feasible(model, described, np.zeros(known.n))
        inertia = standard_parameters(model, described)
        warnings.warn(NearestBodiesWarning(f"{known.name}: {NEAREST.format(moved)}; {REMEDY}"), stacklevel=2)
    if not (inertia[:, 0] > 0).all():
        raise InfeasibleError("a link's identified mass is not positive", remedy=REMEDY)
    friction = linear_friction(model)
    source = known.origin
    from_file = is_description(source) and split_arguments(source)[0].is_file()
    kept: list[str] = []
    root = _updated(source, known, inertia, kept) if from_file else _chain(known, inertia)
    if not from_file and not np.isfinite([known.limits.velocity, known.limits.torque]).all():
        kept.append(f"limits of velocity and effort that are not known are {UNKNOWN_LIMIT:g}")
    if friction is not None:
        _state_friction(root, known, friction)
    remarks = (*_remarks(model, friction, moved), *kept)
    # Two hyphens end a comment.
    comment = f"identified by robot-oed {VERSION}: {'; '.join(remarks)}".replace("--", "-")
    root.insert(0, ElementTree.Comment(f" {comment} "))
    ElementTree.indent(root)
    return Urdf(ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n", remarks)


def _state_friction(root: Element, robot: Robot, friction: LinearFriction) -> None:
    joints = {joint.get("name"): joint for joint in root.findall("joint")}
    for name, damping, coulomb in zip(robot.joint_names, friction.viscous, friction.coulomb, strict=True):
        dynamics = joints[name].find("dynamics")
        if dynamics is None:
            dynamics = ElementTree.SubElement(joints[name], "dynamics")
        dynamics.set("damping", repr(float(damping)))
        dynamics.set("friction", repr(float(coulomb)))


def _remarks(model: Model, friction: LinearFriction | None, moved: float) -> list[str]:
    """What the numbers are, and what of the model the file does not state; `moved` as by `nearest_feasible`."""
    parts = ["inertials"]
    if friction is not None:
        parts[0] += ", damping and friction"
        rough = [
            f"{friction.error[i]:.2g} {model.robot.limits.unit(i, 'torque')} at joint {name}"
            for i, name in enumerate(model.robot.joint_names)
            if friction.error[i] > NAMED_DIFFERENCE * friction.largest[i]
        ]
        if rough:
            text = "damping and friction approximate the identified friction curve; largest difference up to the"
            parts.append(f"{text} recorded speed: {', '.join(rough)}")
    if moved:
        parts.append(NEAREST.format(moved))
    left = unstated_terms(model, {"rigid_body"})
    left += [e.effect.replace("_", " ") + ("" if e.joint is None else f" of joint {e.joint}") for e in model.extensions]
    gravity = np.asarray(model.robot.chain.gravity, dtype=float)
    if np.abs(gravity[:2]).max() > 1e-3 * np.abs(gravity).max() or gravity[2] > 0:
        left.append(f"gravity along ({', '.join(f'{g:.4g}' for g in gravity)}) m/s2 in the base frame")
    if left:
        parts.append(f"not stated, because a URDF cannot: {', '.join(left)}")
    return parts


def _updated(source: str, robot: Robot, inertia: Array, remarks: list[str]) -> Element:
    try:
        root = ElementTree.fromstring(urdf_bytes(source))
    except (OSError, ElementTree.ParseError) as error:
        raise InputError(f"the written URDF could not be read back: {error}", file=source) from error
    links = {link.get("name"): link for link in root.findall("link")}
    moving = set(robot.joint_names)
    fixed = {joint.get("name") for joint in root.findall("joint") if joint.get("type") == "fixed"} - moving
    bodies: dict[str | None, str | None] = {}
    ends = [(_end(joint, "parent"), _end(joint, "child"), joint.get("name")) for joint in root.findall("joint")]
    for _, child, name in ends:
        if name in moving:
            bodies[child] = name
    # Links that are rigidly attached to a moved link move with it.
    pending, attached = list(bodies), set(bodies)
    while pending:
        parent = pending.pop()
        for above, child, name in ends:
            if above == parent and name in fixed:
                _remove_inertial(links[child])
                attached.add(child)
                pending.append(child)
    stated = {link.name: link for link in read_elements(source).links}
    for child, name in bodies.items():
        body = robot.joint_names.index(str(name))
        others = {
            place.name: inertial_parameters(link.mass, link.com, link.inertia_at_com, place.pose)
            for place in robot.links
            if place.body == body + 1 and place.name not in attached and (link := stated[place.name]).mass > 0
        }
        own, _, share = remainder(inertia[body], others, set(), str(name))
        if others:
            remarks.append(f"{', '.join(others)} keep their inertia beside joint {name}, at the locked positions")
        if share < 1.0:
            remarks[-1] += f", their mass times {share:g}, because the identified link is too light for it"
            for other in others:
                link = stated[other]
                _set_inertial(links[other], share * inertial_parameters(link.mass, link.com, link.inertia_at_com, EYE))
        _set_inertial(links[child], own)
    return root


def _set_inertial(link: Element, parameters: Array) -> None:
    _remove_inertial(link)
    link.insert(0, inertial_element(parameters))


def _end(joint: Element, tag: str) -> str | None:
    element = joint.find(tag)
    return None if element is None else element.get("link")


def _remove_inertial(link: Element) -> None:
    for inertial in link.findall("inertial"):
        link.remove(inertial)


def _chain(robot: Robot, inertia: Array) -> Element:
    root = Element("robot", name=robot.name)
    ElementTree.SubElement(root, "link", name="base")
    limits = robot.limits
    for i, joint in enumerate(robot.chain.joints):
        link = ElementTree.SubElement(root, "link", name=f"link_{i + 1}")
        link.append(inertial_element(inertia[i]))
        parent = f"link_{i}" if i else "base"
        bounds = (limits.lower[i], limits.upper[i], limits.velocity[i], limits.torque[i])
        root.append(joint_element(joint, parent, f"link_{i + 1}", bounds))
    return root


def joint_element(joint: Joint, parent: str, child: str, bounds: Sequence[float]) -> Element:
    """Writes a ``<joint>``.

    Args:
        joint: the joint.
        parent: name of a link.
        child: name of the link that it moves.
        bounds: lower, upper, velocity, effort; infinite where unknown.
    """
    lower, upper, velocity, effort = (float(value) for value in bounds)
    limited = bool(np.isfinite([lower, upper]).all())
    kind = joint.kind if joint.kind == "prismatic" or limited else "continuous"
    element = Element("joint", name=joint.name, type=kind)
    pose = {"xyz": numbers(joint.translation), "rpy": numbers(roll_pitch_yaw(np.asarray(joint.rotation)))}
    ElementTree.SubElement(element, "origin", pose)
    ElementTree.SubElement(element, "parent", link=parent)
    ElementTree.SubElement(element, "child", link=child)
    ElementTree.SubElement(element, "axis", xyz=numbers(joint.axis))
    limit = {"lower": lower, "upper": upper} if limited else {}
    # A reader needs both, or neither: a missing one makes the file invalid.
    if limited or np.isfinite([velocity, effort]).any():
        limit |= {"velocity": min(velocity, UNKNOWN_LIMIT), "effort": min(effort, UNKNOWN_LIMIT)}
        ElementTree.SubElement(element, "limit", {name: repr(value) for name, value in limit.items()})
    return element


def inertial_element(parameters: Array) -> Element:
    """The ``<inertial>`` of ten parameters about the link frame: mass, centre of mass, inertia about it."""
    mass = float(parameters[0])
    centre = parameters[1:4] / mass
    about = symmetric(parameters[4:]) - mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    element = Element("inertial")
    ElementTree.SubElement(element, "origin", xyz=numbers(centre), rpy="0 0 0")
    ElementTree.SubElement(element, "mass", value=repr(mass))
    names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    values = about[np.triu_indices(3)]
    ElementTree.SubElement(element, "inertia", {k: repr(float(v)) for k, v in zip(names, values, strict=True)})
    return element


def roll_pitch_yaw(rotation: Array) -> Array:
    """Roll, pitch and yaw of R = Rz(yaw) Ry(pitch) Rx(roll)."""
    horizontal = float(np.hypot(rotation[0, 0], rotation[1, 0]))
    pitch = np.arctan2(-rotation[2, 0], horizontal)
    if horizontal < 1e-12:  # straight up or down: roll and yaw turn about one axis
        return np.array([np.arctan2(-rotation[1, 2], rotation[1, 1]), pitch, 0.0])
    roll, yaw = np.arctan2(rotation[2, 1], rotation[2, 2]), np.arctan2(rotation[1, 0], rotation[0, 0])
    return np.array([roll, pitch, yaw])


def numbers(values: Sequence[float] | Array) -> str:
    """Writes numbers that read back exactly."""
    return " ".join(repr(float(value)) for value in values)
