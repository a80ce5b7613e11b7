"""The bodies and joints of a compiled MuJoCo model as links and joints of a tree, in MuJoCo's frames."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.geometry.chain import homogeneous, joint_motion, rotation_from_quaternion
from robots.geometry.urdf_limits import UrdfLimit
from robots.geometry.urdf_xml import UrdfElements, UrdfJoint, UrdfLink
from robots.mujoco_models.actuators import effort_limit

FREE, BALL, SLIDE, HINGE = range(4)  # mjtJoint


def pose(position: Array, quaternion: Array) -> Array:
    """Composes a transform (4, 4) of MuJoCo's position and quaternion w, x, y, z."""
    return homogeneous(rotation_from_quaternion(np.roll(quaternion, -1)), position)


def _shift(position: Array) -> Array:
    return homogeneous(np.eye(3), position)


class MujocoNames:
    """Names of a compiled model's bodies, joints and sites; unnamed ones are numbered.

    Args:
        library: the module `mujoco`.
        model: the compiled model.
    """

    def __init__(self, library: Any, model: Any) -> None:
        def names(kind: Any, count: int, word: str) -> tuple[str, ...]:
            return tuple(library.mj_id2name(model, kind, i) or f"{word}_{i}" for i in range(count))

        kinds = library.mjtObj
        self.bodies = names(kinds.mjOBJ_BODY, model.nbody, "body")
        self.joints = names(kinds.mjOBJ_JOINT, model.njnt, "joint")
        self.sites = names(kinds.mjOBJ_SITE, model.nsite, "site")


def loose_bodies(model: Any, held: bool = False) -> set[int]:
    """Finds the bodies on free joints, such as objects to grasp, and what they carry.

    Args:
        model: the compiled model.
        held: whether a robot on a free joint is held at its base, and so is not loose.
    """
    carriers = {int(model.body_rootid[model.jnt_bodyid[j]]) for j in range(model.njnt) if model.jnt_type[j] != FREE}
    loose: set[int] = set()
    for body in range(1, model.nbody):
        free = model.body_jntnum[body] and model.jnt_type[model.body_jntadr[body]] == FREE
        if int(model.body_parentid[body]) in loose or (free and not (held and body in carriers)):
            loose.add(body)
    return loose


def read_model(
    library: Any, model: Any, *, file: str, name: str, digest: str, unused: tuple[str, ...], held: bool = False
) -> UrdfElements:
    """Gives links and joints of a compiled model.

    Each joint has a link of its own, with the origin on the joint's anchor and the body's axes. The body's frame and
    its sites hang fixed on the link of its last joint.

    Args:
        library: the module `mujoco`.
        model: the compiled model.
        file: for messages.
        name: of the robot.
        digest: of the file.
        unused: what is not read.
        held: whether a robot on a free joint is held at its base.

    Raises:
        InputError: the robot stands on a free joint, or nothing moves.
    """
    names, loose = MujocoNames(library, model), loose_bodies(model, held)
    moving = [j for j in range(model.njnt) if model.jnt_type[j] in (SLIDE, HINGE)]
    if all(int(model.jnt_bodyid[j]) in loose for j in moving):
        floating = bool(moving)
        raise InputError(
            "the robot stands on a free joint" if floating else "the model has no hinge and no slide joint",
            file=file,
            allowed="a robot on a fixed base" if floating else "one hinge or slide joint or more",
            remedy="remove the <freejoint>" if floating else None,
        )
    links, joints = [_massless(names.bodies[0])], []
    followers = dict(_followers(model, names))
    for body in range(1, model.nbody):
        if body in loose:
            continue
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        above, placement = names.bodies[model.body_parentid[body]], pose(model.body_pos[body], model.body_quat[body])
        for j in range(first, first + count):
            if model.jnt_type[j] not in (SLIDE, HINGE):
                continue
            anchor, axis = model.jnt_pos[j], model.jnt_axis[j]
            prismatic = model.jnt_type[j] == SLIDE
            at_zero = joint_motion(
                "prismatic" if prismatic else "revolute", axis, -float(model.qpos0[model.jnt_qposadr[j]])
            )
            link = f"{names.bodies[body]} at {names.joints[j]}"
            joints.append(
                _joint(model, j, names.joints[j], above, link, placement @ _shift(anchor) @ at_zero, followers)
            )
            links.append(_massless(link))
            above, placement = link, _shift(-anchor)
        links.append(_link(model, body, names.bodies[body]))
        joints.append(_fixed(f"fixed {names.bodies[body]}", above, names.bodies[body], placement))
    used = {link.name for link in links}
    for site in range(model.nsite):
        body = int(model.site_bodyid[site])
        # Sites and bodies have separate names; of the same name, the body is meant.
        if body not in loose and names.sites[site] not in used:
            used.add(names.sites[site])
            links.append(_massless(names.sites[site]))
            at = pose(model.site_pos[site], model.site_quat[site])
            joints.append(_fixed(f"fixed site {names.sites[site]}", names.bodies[body], names.sites[site], at))
    return UrdfElements(file=file, name=name, links=tuple(links), joints=tuple(joints), digest=digest, unused=unused)


def _massless(name: str) -> UrdfLink:
    return UrdfLink(name=name, mass=0.0)


def _link(model: Any, body: int, name: str) -> UrdfLink:
    at = pose(model.body_ipos[body], model.body_iquat[body])
    inertia = at[:3, :3] @ np.diag(model.body_inertia[body]) @ at[:3, :3].T
    return UrdfLink(name=name, mass=float(model.body_mass[body]), com=at[:3, 3], inertia_at_com=inertia)


def _fixed(name: str, parent: str, child: str, placement: Array) -> UrdfJoint:
    return UrdfJoint(
        name=name,
        type="fixed",
        parent=parent,
        child=child,
        placement=placement,
        axis=np.array([1.0, 0.0, 0.0]),
        limit=None,
        damping=0.0,
        friction=0.0,
        mimic=None,
    )


def _joint(
    model: Any,
    j: int,
    name: str,
    parent: str,
    child: str,
    placement: Array,
    followers: dict[str, tuple[str, float, float]],
) -> UrdfJoint:
    limited, prismatic = bool(model.jnt_limited[j]), model.jnt_type[j] == SLIDE
    lower, upper = (float(x) for x in model.jnt_range[j]) if limited else (None, None)
    dof = int(model.jnt_dofadr[j])
    return UrdfJoint(
        name=name,
        type="prismatic" if prismatic else "revolute" if limited else "continuous",
        parent=parent,
        child=child,
        placement=placement,
        axis=np.array(model.jnt_axis[j]),
        limit=UrdfLimit(lower=lower, upper=upper, velocity=np.inf, effort=effort_limit(model, j)),
        damping=float(model.dof_damping[dof]),
        friction=float(model.dof_frictionloss[dof]),
        mimic=followers.get(name),
        rest=float(model.qpos0[model.jnt_qposadr[j]]),
    )


def _followers(model: Any, names: MujocoNames) -> Iterator[tuple[str, tuple[str, float, float]]]:
    """Joints that an equality constraint couples linearly to another one: name, and leader, multiplier, offset."""
    for e in linear_couplings(model):
        one, other = int(model.eq_obj1id[e]), int(model.eq_obj2id[e])
        a0, a1 = (float(x) for x in model.eq_data[e, :2])
        start, leader = (float(model.qpos0[model.jnt_qposadr[j]]) for j in (one, other))
        yield names.joints[one], (names.joints[other], a1, start + a0 - a1 * leader)


def linear_couplings(model: Any) -> list[int]:
    """Lists the active equality constraints that couple two joints linearly."""
    return [
        e
        for e in range(model.neq)
        if model.eq_type[e] == 2  # mjEQ_JOINT
        and model.eq_active0[e]
        and model.eq_obj2id[e] >= 0
        and not np.any(model.eq_data[e, 2:5])
    ]
