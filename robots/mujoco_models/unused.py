"""What of a MuJoCo model is not part of a robot's description."""

from __future__ import annotations

from typing import Any

import numpy as np

from robots.mujoco_models.elements import FREE, HINGE, SLIDE, MujocoNames, linear_couplings, loose_bodies


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
