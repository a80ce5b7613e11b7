"""Putting a robot together from what its files say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array
from robots.common.config import read_config
from robots.common.errors import InputError
from robots.description import MOTOR_UNITS, Bounds, Pose, Range, RobotDescription, Values
from robots.description_notes import assumed_in_urdf, assumed_limits, require_stops, unknown_masses, urdf_notes
from robots.geometry.chain import Chain, LinkPlace, homogeneous, rotation_from_rpy
from robots.geometry.dh import Convention, DhRow, chain_from_dh, dh_frames
from robots.geometry.dh_tables import table_notes, table_rows
from robots.geometry.inertia import BODY_PARAMETERS, check_body, inertial_parameters, symmetric
from robots.geometry.urdf import read_urdf
from robots.geometry.urdf_selection import Choice, digest_of
from robots.joints.controller_axes import ControllerAxes
from robots.joints.velocity_ramps import NO_RAMP, VelocityRamp
from robots.limits import Limits
from robots.mujoco_models import robot_from_mjcf
from robots.per_joint import PerJoint
from robots.robot import Robot


def robot_from_urdf(
    path: Path,
    tip: str | None,
    joints: Sequence[str] | None,
    locked: Mapping[str, float] | None,
    unlimited: bool = False,
) -> Robot:
    """Make a robot of a URDF.

    Args:
        path: the file.
        tip: the link at which the chain ends.
        joints: the moving joints, in the chain's order.
        locked: positions of locked joints [rad or m].
        unlimited: whether joints may lack position limits.

    Returns:
        The robot; what the file does not state is unlimited or unknown, and its `notes` name it.

    Raises:
        InputError: naming the file and the link or joint.
    """
    tree = read_urdf(path)
    taken = tree.chain(tip, joints, locked)
    require_stops(taken.unlimited, unlimited, path)
    friction = tree.friction(taken.names)
    chosen = tip is not None or joints is not None or bool(locked)
    return Robot(
        name=tree.name or path.stem,
        chain=taken.chain,
        limits=taken.limits,
        inertia=taken.inertia,
        friction=friction,
        notes=(
            *urdf_notes(taken, tree.unused),
            *unknown_masses(taken.inertia, taken.names),
            *assumed_in_urdf(taken, friction, tree.root),
        ),
        origin=str(path),
        urdf=str(path),
        links=taken.links,
        # A choice of joints makes another robot of the same file; without one the digest is the file's own.
        digest=digest_of(tree.digest, (tip, joints, locked)) if chosen else tree.digest,
    )


def robot_from_yaml(
    path: Path,
    origin: str,
    tip: str | None,
    joints: Sequence[str] | None,
    locked: Mapping[str, float] | None,
    unlimited: bool = False,
) -> Robot:
    """Make a robot of a robot YAML file.

    Args:
        path: the file.
        origin: the catalogue name or the path, as the user gave it.
        tip: in place of the file's own choice, the link at which the chain ends; for a file that names a URDF.
        joints: likewise, the moving joints in the chain's order.
        locked: likewise, positions of locked joints [rad or m], added to the file's.
        unlimited: whether joints of a URDF may lack position limits.

    Returns:
        The robot.

    Raises:
        InputError: naming the file and the key, link or joint.
    """
    text = read_config(path, RobotDescription)
    content = path.read_bytes()
    chosen = tip is not None or joints is not None or bool(locked)
    notes: tuple[str, ...] = ()
    links: tuple[LinkPlace, ...] = ()
    urdf, mjcf = "", ""
    rotor: Array = np.zeros(())
    frames: Array | None = None
    if text.geometry is not None:
        if chosen:
            problem = "the robot is a Denavit-Hartenberg table, so tip, joints and locked do not apply"
            raise InputError(problem, file=path, remedy="remove tip, joints and locked")
        convention, rows = text.geometry.convention, table_rows(text.geometry, str(path))
        chain = _chain(text, rows, convention)
        entries = PerJoint(str(path), chain, chain.names)
        inertia, friction, limits = np.full((chain.n, BODY_PARAMETERS), np.nan), None, None
        frames, notes = dh_frames(rows, convention), table_notes(rows, convention)
        digest = digest_of(content)
    elif text.mjcf is not None:
        own: Choice = (text.tip, text.joints, text.locked)
        choice = _override(text, tip, joints, locked) if chosen else own
        file, free = path.parent / text.mjcf, unlimited or text.limits.position is not None
        found = robot_from_mjcf(file, *choice, free, alone=False)
        chain, limits, inertia = _at_gravity(found.chain, text), found.limits, found.inertia
        friction, rotor = found.friction, found.rotor_inertia
        names = robot_from_mjcf(file, *own, free, alone=False).joint_names if chosen else found.joint_names
        entries = PerJoint(str(path), chain, names)
        notes, links, mjcf, digest = found.notes, found.links, found.mjcf, digest_of(content, found.digest)
    else:
        tree = read_urdf(path.parent / (text.urdf or ""))
        own = (text.tip, text.joints, text.locked)
        choice = _override(text, tip, joints, locked) if chosen else own
        taken = tree.chain(*choice)
        chain, limits, inertia, names = _at_gravity(taken.chain, text), taken.limits, taken.inertia, taken.names
        entries = PerJoint(str(path), chain, tree.chain(*own).names if chosen else names)
        friction = tree.friction(names)
        digest = digest_of(content, tree.digest, *([choice] if chosen else []))
        known = entries.names if text.limits.position is not None else ()
        taken = taken._replace(unlimited=tuple(name for name in taken.unlimited if name not in known))
        require_stops(taken.unlimited, unlimited, tree.file)
        notes, links, urdf = urdf_notes(taken, tree.unused), taken.links, tree.file
    ratio, rotor, constant, speed = _drives(text, entries, rotor)
    bounds = _limits(text, entries, limits)
    inertia = _inertia(text, entries, inertia, frames)
    notes = (*notes, *unknown_masses(inertia, chain.names))
    if assumed := assumed_limits(bounds, chain.kinds):
        notes = (*notes, f"assumed, because the robot file does not state it: {', '.join(assumed)}")
    return Robot(
        name=text.name,
        title=text.title,
        chain=chain,
        limits=bounds,
        inertia=inertia,
        rotor_inertia=rotor,
        friction=_friction(text, entries, friction),
        gear_ratio=ratio,
        torque_constant=constant,
        motor_speed=speed,
        period=text.period,
        assumed=tuple(text.assumed()),
        notes=notes,
        origin=origin,
        urdf=urdf,
        mjcf=mjcf,
        links=links,
        digest=digest,
        payload=None if text.payload is None else text.payload.value,
        axes=_controller_axes(text, entries),
        ambient=None if text.ambient is None else (text.ambient.lowest, text.ambient.highest),
    )


def _override(
    text: RobotDescription, tip: str | None, joints: Sequence[str] | None, locked: Mapping[str, float] | None
) -> Choice:
    both = {**(text.locked or {}), **(locked or {})}
    if joints is not None:
        return tip, joints, {name: value for name, value in both.items() if name not in joints}
    if tip is not None:
        return tip, None, both
    # Locking a joint that the file lists as moving takes it off that list.
    kept = None if text.joints is None else [name for name in text.joints if name not in (locked or {})]
    return text.tip, kept, both


def _at_gravity(chain: Chain, text: RobotDescription) -> Chain:
    return chain if text.gravity is None else Chain(chain.joints, np.array(text.gravity), chain.tip)


def _pose(pose: Pose | None) -> Array | None:
    return None if pose is None else homogeneous(rotation_from_rpy(pose.rpy), pose.xyz)


def _chain(text: RobotDescription, rows: Sequence[DhRow], convention: Convention) -> Chain:
    return chain_from_dh(
        rows,
        convention,
        base=_pose(text.base),
        flange=_pose(text.flange),
        gravity=(0.0, 0.0, -9.81) if text.gravity is None else text.gravity,
    )


def _inertia(text: RobotDescription, entries: PerJoint, known: Array, frames: Array | None) -> Array:
    """Inertial parameters (n, 10): those of the YAML in its frames (n, 4, 4) of the links, else the known ones."""
    links, n = text.dynamics.links, len(entries.names)
    if links is None:
        return known
    if len(links) != n:
        allowed = f"{n}, one per joint; null where unknown"
        raise InputError(f"{len(links)} links", file=entries.file, column="dynamics.links", allowed=allowed)
    inertia = np.array(known)
    for i, (name, link) in enumerate(zip(entries.names, links, strict=True)):
        if link is None or name not in entries.chain.names:
            continue
        about_com = symmetric(link.inertia_at_com)
        check_body(link.mass, about_com, f"dynamics.links[{i + 1}]", file=entries.file)
        frame = np.eye(4) if frames is None else frames[i]
        inertia[entries.chain.names.index(name)] = inertial_parameters(link.mass, link.com, about_com, frame)
    return inertia


def _limits(text: RobotDescription, entries: PerJoint, known: Limits | None) -> Limits:
    def default(quantity: str) -> ArrayLike:
        if known is not None:
            return getattr(known, quantity)
        return -np.inf if quantity == "lower" else np.inf

    bounds: dict[str, Any] = {}
    position: Range | None = text.limits.position
    for quantity in ("lower", "upper"):
        if position is None:
            bounds[quantity] = np.broadcast_to(np.asarray(default(quantity)), (entries.chain.n,))
        else:
            scale = entries.scale(position.unit, "limits.position.unit", "position")
            key = f"limits.position.{quantity}"
            bounds[quantity] = entries.place(getattr(position, quantity), key, default(quantity), scale)
    for quantity in ("velocity", "acceleration", "jerk", "torque", "torque_rms"):
        stated: Bounds | None = getattr(text.limits, quantity)
        if stated is None:
            bounds[quantity] = np.broadcast_to(np.asarray(default(quantity)), (entries.chain.n,))
        else:
            scale = entries.scale(stated.unit, f"limits.{quantity}.unit", quantity.removesuffix("_rms"))
            bounds[quantity] = entries.place(stated.values, f"limits.{quantity}.values", default(quantity), scale)
    ramp = text.limits.velocity_ramp
    try:
        if ramp is not None:
            values: dict[str, Any] = {
                name: entries.place(getattr(ramp, name), f"limits.velocity_ramp.{name}", none)
                for name, none in NO_RAMP.items()
            }
            bounds["ramp"] = VelocityRamp(**values)
        return Limits(**bounds)
    except InputError as error:
        raise InputError(
            error.problem,
            file=entries.file,
            column=f"limits.{error.column or 'position'}",
            joint=error.joint,
            allowed=error.allowed,
            remedy=error.remedy,
        ) from error


def _controller_axes(text: RobotDescription, entries: PerJoint) -> ControllerAxes | None:
    stated, n = text.controller_axes, entries.chain.n
    if stated is None:
        return None
    scale = entries.scale(stated.unit, "controller_axes.unit", "position")
    coupling = np.zeros((n, n))
    for item in stated.couplings:
        if max(item.axis, item.joint) > n or item.axis == item.joint:
            raise InputError(
                f"axis {item.axis} and joint {item.joint}",
                file=entries.file,
                column="controller_axes.couplings",
                allowed=f"two of {n} joints",
            )
        coupling[item.axis - 1, item.joint - 1] = item.factor
    try:
        return ControllerAxes(
            sign=entries.place(stated.sign, "controller_axes.sign", 1.0),
            zero=entries.place(stated.zero, "controller_axes.zero", 0.0, scale),
            coupling=coupling,
        )
    except InputError as error:
        raise InputError(
            error.problem,
            file=entries.file,
            column=f"controller_axes.{error.column}",
            joint=error.joint,
            allowed=error.allowed,
        ) from error


def _values(stated: Values | None, entries: PerJoint, key: str, default: ArrayLike) -> Array:
    if stated is None:
        return np.array(np.broadcast_to(np.asarray(default, dtype=np.float64), (entries.chain.n,)))
    return entries.place(stated.values, f"{key}.values", default)


def _drives(text: RobotDescription, entries: PerJoint, known: Array) -> tuple[Array, Array, Array, Array]:
    """Gear ratio, then rotor inertia and torque constant as felt at the joint, then the motor's highest speed.

    Rotor inertias that the file does not state are the known ones at the joint.
    """
    drives = text.dynamics.drives
    at_motor = [name for name in ("rotor_inertia", "torque_constant", "motor_speed") if getattr(drives, name)]
    if drives.gear_ratio is None and at_motor:
        problem = f"{at_motor[0]} refers to the motor, but the gear_ratio needed to convert it is missing"
        raise InputError(problem, file=entries.file, column="dynamics.drives", remedy="state gear_ratio")
    key = "dynamics.drives"
    ratio = _values(drives.gear_ratio, entries, f"{key}.gear_ratio", 1.0)
    rotor = _values(drives.rotor_inertia, entries, f"{key}.rotor_inertia", np.nan)
    constant = _values(drives.torque_constant, entries, f"{key}.torque_constant", np.nan)
    speed = np.full(entries.chain.n, np.inf)
    if drives.motor_speed is not None:
        unit = MOTOR_UNITS[drives.motor_speed.unit]
        speed = entries.place(drives.motor_speed.values, f"{key}.motor_speed.values", np.inf, unit)
    return ratio, np.where(np.isnan(rotor), known, ratio**2 * rotor), ratio * constant, speed


def _friction(text: RobotDescription, entries: PerJoint, known: Array | None) -> Array:
    stated = text.dynamics.friction
    columns = []
    for i, name in enumerate(("coulomb", "viscous", "quadratic", "cubic")):
        default = 0.0 if known is None else known[:, i]
        columns.append(_values(getattr(stated, name), entries, f"dynamics.friction.{name}", default))
    return np.column_stack(columns)
