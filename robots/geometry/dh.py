"""Chains from Denavit-Hartenberg parameters, standard and modified."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.geometry.chain import Chain, Joint, Kind, homogeneous

Convention = Literal["standard", "modified"]


@dataclass(frozen=True, kw_only=True)
class DhRow:
    """One row of a Denavit-Hartenberg table.

    Args:
        kind: "revolute" (q adds to ``offset``) or "prismatic" (q adds to ``d``).
        alpha: twist [rad].
        a: length [m].
        d: distance along the joint axis [m].
        offset: angle about the joint axis at q = 0 [rad].
        name: the joint's name; by default "J" and its number.
    """

    kind: Kind = "revolute"
    alpha: float = 0.0
    a: float = 0.0
    d: float = 0.0
    offset: float = 0.0
    name: str | None = None


def _turn(angle: float, axis: Literal["x", "z"]) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    if axis == "x":
        return homogeneous([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]], np.zeros(3))
    return homogeneous([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]], np.zeros(3))


def _shift(x: float, z: float) -> Array:
    return homogeneous(np.eye(3), [x, 0.0, z])


def _check(convention: str) -> None:
    if convention not in get_args(Convention):
        raise InputError(f"unknown convention {convention!r}", allowed=" or ".join(get_args(Convention)))


def dh_frames(rows: Sequence[DhRow], convention: Convention) -> Array:
    """Poses of the table's frames i in our link frames i.

    Both sit on the same body. They coincide in the modified convention. In the standard one, frame i lies at the far
    end of link i, ``Tz(d) Tx(a) Rx(alpha)`` away from our link frame, which stays on the joint's own axis.

    Args:
        rows: the table, from the base to the flange.
        convention: "standard" or "modified".

    Returns:
        (n, 4, 4).

    Raises:
        InputError: on an unknown convention.
    """
    _check(convention)
    if convention == "modified":
        return np.tile(np.eye(4), (len(rows), 1, 1))
    return np.array([_shift(row.a, row.d) @ _turn(row.alpha, "x") for row in rows])


def chain_from_dh(
    rows: Sequence[DhRow],
    convention: Convention,
    *,
    base: ArrayLike | None = None,
    flange: ArrayLike | None = None,
    gravity: ArrayLike = (0.0, 0.0, -9.81),
) -> Chain:
    """Build a chain from a Denavit-Hartenberg table.

    Modified (Craig): ``T_i = Rx(alpha) Tx(a) Rz(q + offset) Tz(d)``; the link frame is frame i.
    Standard: ``T_i = Rz(q + offset) Tz(d) Tx(a) Rx(alpha)``; the joint frame is frame i-1 turned by the offset, and
    the link frame is that frame moved by q, so that its z is the joint's own axis in either convention.
    For a prismatic joint q adds to d in place of the angle.

    Args:
        rows: the table, from the base to the flange.
        convention: "standard" or "modified".
        base: (4, 4) pose of frame 0 in the base frame, in which gravity is given; identity by default.
        flange: (4, 4) pose of the flange in frame n; identity by default.
        gravity: (3,) acceleration of gravity in the base frame [m/s2].

    Returns:
        The chain, every axis along z.

    Raises:
        InputError: naming the joint whose row is not finite, or on an unknown convention.
    """
    frames = dh_frames(rows, convention)
    joints = []
    before: Array = np.eye(4) if base is None else np.asarray(base, dtype=np.float64)
    for i, (row, frame) in enumerate(zip(rows, frames, strict=True)):
        if not np.isfinite([row.alpha, row.a, row.d, row.offset]).all():
            raise InputError("the Denavit-Hartenberg row is not finite", joint=i + 1)
        if convention == "modified":
            # Rz(q + offset) and Tz(d) commute, so all that is fixed comes before the motion.
            placement = before @ _turn(row.alpha, "x") @ _shift(row.a, 0.0) @ _turn(row.offset, "z")
            placement = placement @ _shift(0.0, row.d)
        else:
            placement = before @ _turn(row.offset, "z")
        joints.append(Joint(row.name or f"J{i + 1}", row.kind, placement[:3, :3], placement[:3, 3]))
        before = frame
    tip = before if flange is None else before @ np.asarray(flange, dtype=np.float64)
    return Chain(tuple(joints), np.asarray(gravity, dtype=np.float64), tip)
