"""A joint's pose as an expression in its position, as sparse as its geometry allows."""

from __future__ import annotations

import casadi
import numpy as np

from robots.common.arrays import Array
from robots.geometry.chain import Joint


def cleaned(values: Array) -> Array:
    """Rounds entries that miss a whole number by less than 1e-15."""
    # cos(pi / 2) is 6e-17: left in, it hides exact zeros and ones from the symbolic simplifier.
    rounded = np.round(values)
    return np.where(np.abs(values - rounded) < 1e-15, rounded, values)


def symbolic_placement(joint: Joint, q: casadi.SX) -> tuple[casadi.SX, casadi.SX]:
    """Gives the pose of the moved joint frame in its parent: rotation (3, 3) and origin (3,) [m].

    Args:
        joint: the joint.
        q: its position [rad or m].
    """
    rotation, translation = casadi.SX(cleaned(joint.rotation)), casadi.SX(cleaned(joint.translation))
    axis = cleaned(joint.axis)
    if joint.kind == "prismatic":
        return casadi.sparsify(rotation), translation + rotation @ casadi.SX(axis) * q
    cross = casadi.skew(casadi.SX(axis))
    outer = casadi.SX(axis) @ casadi.SX(axis).T
    # Rodrigues, written so that a coordinate axis leaves no 1 - cos(q) behind.
    turn = outer + casadi.cos(q) * (casadi.SX(cleaned(np.eye(3) - np.outer(axis, axis)))) + casadi.sin(q) * cross
    return casadi.sparsify(rotation @ turn), translation
