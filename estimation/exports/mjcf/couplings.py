"""Couplings of neighbouring joints as MuJoCo's fixed tendons."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimation.models.extension import Extension
from robots.common.arrays import Array


@dataclass(frozen=True, kw_only=True)
class Tendon:
    """A fixed tendon of the length ``q_inner + way q_outer``.

    Its damping d acts with d on both joints and with ``way d`` between them, and so does its armature.
    """

    way: float
    damping: float = 0.0
    armature: float = 0.0
    frictionloss: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Coupling:
    """The tendons between joints ``inner`` and ``inner + 1``, counted from 0, and what they state nearly."""

    inner: int
    tendons: tuple[Tendon, ...]
    remarks: tuple[str, ...]


def coupling_of(extension: Extension, armature: Array, damping: Array | None) -> Coupling | None:
    """Gives the tendons of a joint coupling and takes their own part off the two joints.

    A tendon adds as much inertia and damping to each joint as between them, so that each joint gets less of its own.

    Args:
        extension: the effect.
        armature: (n,) of the joints, changed in place.
        damping: (n,) of the joints, changed in place; None if the model has no friction.

    Returns:
        The coupling; None where the joints have too little inertia or damping to take it off.
    """
    assert extension.joint is not None
    inner, outer = extension.joint - 2, extension.joint - 1
    inertia, on_inner, on_outer, coulomb = (float(value) for value in extension.coefficients)
    way, viscous = float(extension.shape[0]), (on_inner + on_outer) / 2.0
    pair = [inner, outer]
    lacks_damping = viscous != 0.0 and (damping is None or damping[pair].min() < abs(viscous))
    if coulomb < 0.0 or lacks_damping or armature[pair].min() < abs(inertia):
        return None
    armature[pair] -= abs(inertia)
    if damping is not None:
        damping[pair] -= abs(viscous)
    tendons = []
    for sign in (1.0, -1.0):
        tendon = Tendon(
            way=sign,
            damping=abs(viscous) if np.sign(viscous) == sign else 0.0,
            armature=abs(inertia) if np.sign(inertia) == sign else 0.0,
            frictionloss=coulomb if way == sign else 0.0,
        )
        if tendon.damping or tendon.armature or tendon.frictionloss:
            tendons.append(tendon)
    # A difference of the two directions of more than 5 % is named.
    uneven = abs(on_inner - on_outer) > 0.05 * max(abs(on_inner), abs(on_outer))
    remark = (
        f"the viscous coupling of joints {inner + 1} and {outer + 1} is the mean of {on_inner:.2g} and {on_outer:.2g}, "
        "because a tendon acts on both alike"
    )
    return Coupling(inner=inner, tendons=tuple(tendons), remarks=(remark,) if uneven else ())
