"""A robot from a MuJoCo model file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.description_notes import lacking
from robots.geometry.chain import Chain
from robots.geometry.urdf import UrdfChain, UrdfTree
from robots.geometry.urdf_selection import digest_of
from robots.mujoco_models.actuators import added_by_actuators
from robots.mujoco_models.elements import FREE, HINGE, SLIDE, MujocoNames, linear_couplings, loose_bodies, read_model
from robots.mujoco_models.files import compile_mjcf, mujoco_library, read_xml
from robots.robot import Robot


def robot_from_mjcf(
    path: Path,
    tip: str | None = None,
    joints: Sequence[str] | None = None,
    locked: Mapping[str, float] | None = None,
    unlimited: bool = False,
    *,
    alone: bool = True,
    held: bool = False,
) -> Robot:
    """Makes a robot of an MJCF file.

    MuJoCo compiles it, so that defaults, inertias from geoms, and angles in degrees are as in a simulation. Friction
    is ``frictionloss sign(dq) + damping dq``, and the rotor inertia is ``armature``.

    Args:
        path: the file.
        tip: the body or site at which the chain ends.
        joints: the moving joints, in the chain's order.
        locked: positions of locked joints [rad or m]; ``ref`` where not stated.
        unlimited: whether slide joints may lack a range.
        alone: whether no other file states what this one does not.
        held: whether a robot on a free joint is held at its base.

    Returns:
        The robot; what the file does not state is unlimited or unknown, and its `notes` name it.

    Raises:
        InputError: naming the file and the body or joint; MuJoCo is not installed or refuses the file.
    """
    tree, library, model = _tree(path, held)
    names, unused, digest = MujocoNames(library, model), tree.unused, tree.digest
    taken = tree.chain(tip, joints, locked)
    if taken.unlimited and not unlimited:
        raise InputError(
            "the slide joint has no range",
            file=path,
            joint=taken.unlimited[0],
            remedy="state its range, or accept unlimited positions (--unlimited; in Python unlimited=True)",
        )
    number = {joint: j for j, joint in enumerate(names.joints)}
    friction, armature = _drives(model, [number[joint] for joint in taken.names], str(path), taken.names)
    disabled = int(library.mjtDisableBit.mjDSBL_GRAVITY) & int(model.opt.disableflags)
    gravity = np.zeros(3) if disabled else np.array(model.opt.gravity)
    chosen = tip is not None or joints is not None or bool(locked)
    return Robot(
        name=tree.name,
        chain=Chain(taken.chain.joints, gravity, taken.chain.tip),
        limits=taken.limits,
        inertia=taken.inertia,
        rotor_inertia=armature,
        friction=friction,
        notes=tuple(_notes(taken, unused, friction, alone)),
        origin=str(path),
        mjcf=str(path),
        links=taken.links,
        digest=digest_of(digest, (tip, joints, locked)) if chosen else digest,
    )


def mjcf_tree(path: Path, held: bool = False) -> UrdfTree:
    """Reads the tree of an MJCF file's bodies.

    Args:
        path: the file.
        held: whether a robot on a free joint is held at its base.

    Raises:
        InputError: see `robot_from_mjcf`.
    """
    return _tree(path, held)[0]


def _tree(path: Path, held: bool) -> tuple[UrdfTree, Any, Any]:
    """The tree, the module `mujoco` and the compiled model."""
    xml = read_xml(path)
    library, model = mujoco_library(path), compile_mjcf(path)
    unused = unused_parts(library, model, MujocoNames(library, model))
    name = xml.root.get("model") or path.stem
    elements = read_model(library, model, file=str(path), name=name, digest=xml.digest, unused=unused, held=held)
    return UrdfTree(elements, kind="MJCF"), library, model


def _drives(model: Any, numbers: Sequence[int], file: str, names: Sequence[str]) -> tuple[Array, Array]:
    """Friction (n, 4) and rotor inertia (n,) at the joints."""
    friction, armature = np.zeros((len(numbers), 4)), np.zeros(len(numbers))
    for i, j in enumerate(numbers):
        dof = int(model.jnt_dofadr[j])
        inertia, damping = added_by_actuators(model, j)
        friction[i, :2] = model.dof_frictionloss[dof], model.dof_damping[dof] + damping
        if hasattr(model, "dof_dampingpoly"):
            friction[i, 2:] = model.dof_dampingpoly[dof, :2]
        armature[i] = model.dof_armature[dof] + inertia
        if armature[i] < 0.0 or (friction[i, :2] < 0.0).any():
            raise InputError(
                "a negative armature, damping or frictionloss", file=file, joint=names[i], allowed="zero or more"
            )
    return friction, armature


def _notes(taken: UrdfChain, unused: Sequence[str], friction: Array, alone: bool) -> list[str]:
    notes = list(taken.notes)
    if unused:
        notes.append(f"not used from the MJCF: {'; '.join(unused)}")
    if not alone:
        return notes
    parts = ["no velocity, acceleration and jerk limits", "a controller period of 4 ms"]
    parts += lacking("friction", ~friction.any(axis=1), taken.names)
    parts += lacking("torque limits", ~np.isfinite(taken.limits.torque), taken.names)
    notes.append(f"assumed, because the MJCF does not state it: {', '.join(parts)}")
    return notes


def unused_parts(library: Any, model: Any, names: MujocoNames) -> tuple[str, ...]:
    """Lists the parts that are not read, with where or how often they occur.

    Args:
        library: the module `mujoco`.
        model: the compiled model.
        names: of its bodies and joints.
    """
    hinges = [j for j in range(model.njnt) if model.jnt_type[j] in (SLIDE, HINGE)]
    springs = [names.joints[j] for j in hinges if model.jnt_stiffness[j] or _row(model, "jnt_stiffnesspoly", j)]
    objects = [names.bodies[b] for b in sorted(loose_bodies(model)) if _is_free(model, b)]
    balls = [names.joints[j] for j in range(model.njnt) if model.jnt_type[j] not in (FREE, SLIDE, HINGE)]
    lifted = [names.bodies[b] for b in np.flatnonzero(model.body_gravcomp)]
    colliding = int(np.count_nonzero(np.asarray(model.geom_contype) | np.asarray(model.geom_conaffinity)))
    medium = any(np.any(value) for value in (model.opt.density, model.opt.viscosity, model.opt.wind))
    parts = [
        _named("spring of joint", "springs of joints", springs),
        _named("ball joint (locked)", "ball joints (locked)", balls),
        _named("body on a free joint", "bodies on free joints", objects),
        _named("gravity compensation of body", "gravity compensation of bodies", lifted),
        _counted(model.ntendon, "tendon"),
        _counted(int(np.sum(model.eq_active0)) - len(linear_couplings(model)), "equality constraint"),
        _counted(getattr(model, "nflex", 0), "flexible body", "flexible bodies"),
        _counted(getattr(model, "nplugin", 0), "plug-in"),
        f"contacts of {colliding} geoms" if colliding else "",
        "drag of the medium" if medium else "",
        "controllers of the actuators" if np.any(model.actuator_biastype) or model.na else "",
    ]
    return tuple(part for part in parts if part)


def _row(model: Any, name: str, joint: int) -> bool:
    values = getattr(model, name, None)
    return values is not None and bool(np.any(values[joint]))


def _is_free(model: Any, body: int) -> bool:
    return bool(model.body_jntnum[body]) and model.jnt_type[model.body_jntadr[body]] == FREE


def _named(one: str, many: str, names: list[str]) -> str:
    return f"{one if len(names) == 1 else many} {', '.join(names)}" if names else ""


def _counted(count: int, one: str, many: str = "") -> str:
    return f"{count} {one if count == 1 else many or one + 's'}" if count > 0 else ""
