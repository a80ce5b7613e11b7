"""A user's MJCF with new numbers: only what a model identifies changes, everything else stays."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from estimation.exports.mjcf.contents import Contents
from estimation.exports.mjcf.xml_elements import inertial, insert, no_inertial, payload_body, tendons
from estimation.exports.remainders import remainder
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.geometry.chain import homogeneous
from robots.geometry.inertia import inertial_parameters
from robots.mujoco_models.actuators import actuators_of
from robots.mujoco_models.elements import HINGE, MujocoNames, pose
from robots.mujoco_models.files import compile_mjcf, mujoco_library, read_xml
from robots.robot import Robot
from robots.terms.situations.sensitivities import moved_body

Element = ElementTree.Element

FRICTION_TIME_STEPS = 2.0  # time constant of dry friction in time steps, the smallest that MuJoCo accepts
DEFAULT_SOLREF = (0.02, 1.0)


class Source(NamedTuple):
    """An MJCF, compiled, and where its joints and bodies are in the XML."""

    path: Path
    root: Element
    model: Any
    names: MujocoNames
    joints: dict[str, Element]
    bodies: dict[str, Element]


def edited(contents: Contents, robot: Robot, folder: Path) -> Element:
    """Edits the file that a robot came from.

    Args:
        contents: the numbers; remarks are added to it.
        robot: read from an MJCF.
        folder: into which the result is written; paths of meshes and textures will be relative to it.

    Returns:
        The root element.

    Raises:
        InputError: a joint or body that is not found in the text of the file.
        InfeasibleError: what remains of a link beside the bodies on it is no body.
    """
    source = read_source(Path(robot.mjcf))
    numbers = [source.names.joints.index(name) for name in robot.joint_names]
    _write_bodies(source, contents, robot, numbers)
    for i, j in enumerate(numbers):
        _write_joint(source, contents, robot, i, j)
    _quiet_actuators(source, numbers)
    added = tendons(contents.couplings, robot.joint_names, hasattr(source.model, "tendon_armature"))
    if added:
        section = source.root.find("tendon")
        if section is None:
            section = Element("tendon")
            insert(source.root, len(source.root), section)
        for element in added:
            section.append(element)
    keep_assets(source, folder)
    return source.root


def read_source(path: Path) -> Source:
    """Reads an MJCF to edit it.

    Raises:
        InputError: a file that MuJoCo refuses, or a joint or body without a name that cannot be found in its text.
    """
    xml = read_xml(path)
    model = compile_mjcf(path, warn=False)
    names = MujocoNames(mujoco_library(path), model)
    elements = [element for world in xml.root.findall("worldbody") for element in _bodies(world)]
    hinges = [joint for body in elements for joint in _own(body, ("joint", "freejoint"))]
    return Source(
        path,
        xml.root,
        model,
        names,
        _by_name(names.joints, hinges, path, "joint"),
        _by_name(names.bodies[1:], elements, path, "body"),
    )


def _bodies(parent: Element) -> Iterator[Element]:
    """Bodies in MuJoCo's order; frames only group elements."""
    for child in parent:
        if child.tag == "body":
            yield child
        if child.tag in ("body", "frame"):
            yield from _bodies(child)


def _own(body: Element, tags: tuple[str, ...]) -> Iterator[Element]:
    for child in body:
        if child.tag in tags:
            yield child
        elif child.tag == "frame":
            yield from _own(child, tags)


def _by_name(names: tuple[str, ...], elements: list[Element], path: Path, word: str) -> dict[str, Element]:
    """Finds the elements by name, unnamed ones by their order."""
    named = {element.get("name", ""): element for element in elements}
    if len(names) == len(elements):
        return {name: named.get(name, element) for name, element in zip(names, elements, strict=True)}
    unknown = [element for element in elements if not element.get("name")]
    if unknown:
        raise InputError(f"a {word} has no name, and the file generates other ones", file=path, remedy="name it")
    return {name: named[name] for name in names if name in named}


def _element(found: dict[str, Element], name: str, path: Path, word: str) -> Element:
    if name not in found:
        raise InputError(
            f"the {word} {name!r} is not in the text of the file",
            file=path,
            allowed="bodies and joints that are written out, not replicated or attached",
        )
    return found[name]


def _write_bodies(source: Source, contents: Contents, robot: Robot, numbers: list[int]) -> None:
    model, names = source.model, source.names
    if any(compiler.get("inertiafromgeom") == "true" for compiler in source.root.findall("compiler")):
        for body in source.bodies.values():
            _remove_inertial(body)
    # Without it, bodies that stay as they are need the masses that it gave them.
    scaled = any("settotalmass" in compiler.attrib for compiler in source.root.findall("compiler"))
    for compiler in source.root.findall("compiler"):
        for key in ("inertiafromgeom", "settotalmass", "balanceinertia"):
            compiler.attrib.pop(key, None)
    index = {name: b for b, name in enumerate(names.bodies)}
    for i, j in enumerate(numbers):
        carrier = int(model.jnt_bodyid[j])
        others = [(index[p.name], p.pose) for p in robot.links if p.body == i + 1 and p.name in index]
        others = [(b, at) for b, at in others if b != carrier and model.body_mass[b] > 0.0]
        fixed = {b for b, _ in others if model.body_weldid[b] == model.body_weldid[carrier]}
        inertias = {b: body_inertia(model, b, at) for b, at in others}
        own, emptied, share = remainder(contents.inertia[i], inertias, fixed, robot.joint_names[i])
        to_body = homogeneous(np.eye(3), np.array(model.jnt_pos[j]))
        element = _element(source.bodies, names.bodies[carrier], source.path, "body")
        set_inertial(element, inertial(moved_body(to_body) @ own))
        for b in {b for b, _ in others if scaled or share < 1.0} - emptied:
            stated = share * body_inertia(model, b, np.eye(4))
            set_inertial(_element(source.bodies, names.bodies[b], source.path, "body"), inertial(stated))
        if share < 1.0:
            listed = ", ".join(names.bodies[b] for b, _ in others if b not in emptied)
            contents.remarks.append(f"{listed}: mass times {share:g}, because the identified link is too light for it")
        for b in emptied:
            set_inertial(_element(source.bodies, names.bodies[b], source.path, "body"), no_inertial())
        if i == robot.n - 1 and contents.payload is not None:
            insert(element, len(element), payload_body(contents.payload, to_body @ np.asarray(robot.chain.tip)))


def body_inertia(model: Any, body: int, at: Array) -> Array:
    """Gives the inertial parameters (10,) of a compiled body in a frame in which the body is at `at` (4, 4)."""
    principal = pose(model.body_ipos[body], model.body_iquat[body])
    moments = np.diag(model.body_inertia[body])
    return inertial_parameters(float(model.body_mass[body]), np.zeros(3), moments, at @ principal)


def _remove_inertial(body: Element) -> None:
    for element in list(body.findall("inertial")):
        body.remove(element)


def set_inertial(body: Element, element: Element) -> None:
    """Gives a body another inertia."""
    present = body.find("inertial")
    if present is None:
        insert(body, 0, element)
        return
    present.attrib.clear()
    present.attrib.update(element.attrib)


def _write_joint(source: Source, contents: Contents, robot: Robot, i: int, j: int) -> None:
    model, name = source.model, robot.joint_names[i]
    element, dof = _element(source.joints, name, source.path, "joint"), int(model.jnt_dofadr[j])
    element.set("armature", repr(float(contents.armature[i])))
    if contents.damping is not None and contents.coulomb is not None:
        # Since version 4 further numbers state powers of the velocity; they may come from a default class.
        element.set("damping", _first(contents.damping[i], getattr(model, "dof_dampingpoly", None), dof))
        element.set("frictionloss", repr(float(contents.coulomb[i])))
        if contents.coulomb[i] > 0.0 and tuple(model.dof_solref[dof]) == DEFAULT_SOLREF:
            element.set("solreffriction", f"{FRICTION_TIME_STEPS * float(model.opt.timestep)!r} 1")
    stiffness = float(contents.stiffness[i])
    had_spring = bool(model.jnt_stiffness[j])
    if stiffness or had_spring:
        element.set("stiffness", _first(stiffness, getattr(model, "jnt_stiffnesspoly", None), j))
    if stiffness:
        turns = model.jnt_type[j] == HINGE and _in_degrees(source.root)
        reference = float(contents.springref[i])
        element.set("springref", repr(float(np.rad2deg(reference)) if turns else reference))
    elif had_spring:
        contents.remarks.append(
            f"the file's spring of joint {name} ({float(model.jnt_stiffness[j]):.3g}) was removed: the identified "
            "model has none"
        )


def _first(value: float, powers: Any, row: int) -> str:
    further = [] if powers is None or not np.any(powers[row]) else [0.0] * len(powers[row])
    return " ".join(repr(float(number)) for number in (value, *further))


def _in_degrees(root: Element) -> bool:
    stated = [compiler.get("angle") for compiler in root.findall("compiler") if compiler.get("angle")]
    return not stated or stated[-1] == "degree"


def _quiet_actuators(source: Source, numbers: list[int]) -> None:
    """Takes inertia and damping off the actuators: the joints have all of it now."""
    model = source.model
    if not hasattr(model, "actuator_armature") or not hasattr(model, "actuator_damping"):
        return
    joints = {source.names.joints[j] for j in numbers for a, _ in actuators_of(model, j)}
    for section in source.root.findall("actuator"):
        for actuator in section:
            if actuator.get("joint") in joints:
                a = next(a for a, _ in actuators_of(model, source.names.joints.index(str(actuator.get("joint")))))
                for key, values in (("armature", model.actuator_armature), ("damping", model.actuator_damping)):
                    if values[a]:
                        actuator.set(key, "0")


def keep_assets(source: Source, folder: Path) -> None:
    """Rewrites folders of meshes and textures as seen from the folder of the new file."""
    old = source.path.resolve().parent
    files = any(element.get("file") for element in source.root.iter() if isinstance(element.tag, str))
    if not files or folder.resolve() == old:
        return
    compilers = source.root.findall("compiler")
    stated: dict[str, str] = {}
    for compiler in compilers:
        stated |= compiler.attrib
        for key in ("assetdir", "meshdir", "texturedir"):
            compiler.attrib.pop(key, None)
    if not compilers:
        compilers = [Element("compiler")]
        insert(source.root, 0, compilers[0])
    for key in ("meshdir", "texturedir"):
        named = old / stated.get(key, stated.get("assetdir", ""))
        compilers[0].set(key, os.path.relpath(named, folder.resolve()))
