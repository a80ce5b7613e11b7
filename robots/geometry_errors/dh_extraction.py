"""Denavit-Hartenberg tables of a chain, in both conventions, with Hayati's turn where axes are nearly parallel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array
from robots.geometry.chain import Chain, Kind, homogeneous, joint_motion
from robots.geometry.dh import Convention

PARALLEL = 0.05  # sine of the angle between axes, below which their common normal may be far away
MEET = 0.01  # m; axes that pass each other nearer count as meeting, so that errors of a millimetre turn no table round
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, kw_only=True)
class TableRow:
    """One row.

    Modified: ``Rx(alpha) Tx(a) Ry(beta) Rz(q + offset) Tz(d)``. Standard: ``Rz(q + offset) Tz(d) Tx(a) Rx(alpha)
    Ry(beta)``. Beta is zero where the axes are not nearly parallel (Hayati and Mirmirani 1985).

    Attributes:
        name: of the joint.
        kind: "revolute" or "prismatic", where q adds to d.
        alpha: [rad].
        a: [m].
        beta: [rad].
        d: [m].
        offset: [rad].
    """

    name: str
    kind: Kind
    alpha: float
    a: float
    beta: float
    d: float
    offset: float


@dataclass(frozen=True, kw_only=True, eq=False)
class DhTable:
    """A table of a chain.

    Attributes:
        convention: "modified" or "standard".
        rows: one per joint.
        base: pose of frame 0 in the base frame (4, 4).
        flange: pose of the flange in frame n (4, 4).
    """

    convention: Convention
    rows: tuple[TableRow, ...]
    base: Array
    flange: Array

    def flange_pose(self, q: ArrayLike) -> Array:
        """Pose of the flange by the table (..., 4, 4).

        Args:
            q: (..., n) [rad or m].
        """
        q = np.asarray(q, dtype=float)
        pose = self.base
        for i, row in enumerate(self.rows):
            link = _turn(row.alpha, 0) @ homogeneous(np.eye(3), [row.a, 0.0, 0.0]) @ _turn(row.beta, 1)
            fixed = _turn(row.offset, 2) @ homogeneous(np.eye(3), [0.0, 0.0, row.d])
            joint = joint_motion(row.kind, UP, q[..., i]) @ fixed
            pose = pose @ link @ joint if self.convention == "modified" else pose @ joint @ link
        return np.asarray(pose @ self.flange)


def dh_table(chain: Chain, convention: Convention) -> DhTable:
    """Finds the table of a chain; the flange is where the chain has it, to rounding.

    Args:
        chain: any chain.
        convention: "modified" (Craig) or "standard".
    """
    n = chain.n
    poses = np.concatenate([chain.transforms(np.zeros(n)), chain.flange(np.zeros(n))[None]])
    points = poses[:n, :3, 3]
    axes = np.array([poses[i, :3, :3] @ joint.axis for i, joint in enumerate(chain.joints)])
    # Frame 0: z along the first axis, its origin and x nearest to those of the base.
    origin = points[0] - (points[0] @ axes[0]) * axes[0]
    x = _across(np.array([1.0, 0.0, 0.0]), axes[0])
    frame = _frame(origin, x, axes[0])
    base = frame
    links, joints = [], []
    for i in range(n):
        if i + 1 < n:
            start, following, x_next = _normal(frame[:3, 3], points[i], axes[i], points[i + 1], axes[i + 1], x)
        else:
            start, following, x_next = frame[:3, 3], frame[:3, 3], x
        d = float((start - frame[:3, 3]) @ axes[i])
        offset = float(np.arctan2(np.cross(x, x_next) @ axes[i], x @ x_next))
        joints.append((d, offset))
        frame = _frame(start, x_next, axes[i])
        if i + 1 < n:
            z = frame[:3, :3].T @ axes[i + 1]
            beta, alpha = float(np.arcsin(np.clip(z[0], -1.0, 1.0))), float(np.arctan2(-z[1], z[2]))
            beta = 0.0 if abs(beta) < 1e-14 else beta
            a = float((following - start) @ x_next)
            links.append((alpha, a, beta))
            frame = frame @ _turn(alpha, 0) @ homogeneous(np.eye(3), [a, 0.0, 0.0]) @ _turn(beta, 1)
            x = frame[:3, 0]
    none = (0.0, 0.0, 0.0)
    before = [none, *links] if convention == "modified" else [*links, none]
    rows = tuple(
        TableRow(name=joint.name, kind=joint.kind, alpha=alpha, a=a, beta=beta, d=d, offset=offset)
        for joint, (alpha, a, beta), (d, offset) in zip(chain.joints, before, joints, strict=True)
    )
    return DhTable(convention=convention, rows=rows, base=base, flange=np.linalg.inv(frame) @ poses[n])


def _normal(
    origin: Array, point: Array, axis: Array, next_point: Array, next_axis: Array, x: Array
) -> tuple[Array, Array, Array]:
    """Where the way to the next axis leaves this one, where it arrives, and its direction."""
    across = np.cross(axis, next_axis)
    sine = float(np.linalg.norm(across))
    if sine < PARALLEL:
        # In the plane across this axis at the origin, which the next axis meets nearby.
        start = origin
        along = float((start - next_point) @ axis) / float(next_axis @ axis)
        arrival = next_point + along * next_axis
        way = arrival - start
        length = float(np.linalg.norm(way))
        return start, arrival, _across(way, axis) if length > 1e-9 else x
    gap = next_point - point
    solved = np.linalg.solve(np.column_stack([axis, -next_axis, across]), gap)
    start, arrival = point + solved[0] * axis, next_point + solved[1] * next_axis
    direction = across / sine
    # Two directions fit: the one along the way, or the nearer to the x before where the axes meet.
    along = float((arrival - start) @ direction)
    sign = np.sign(along) if abs(along) > MEET else (np.sign(direction @ x) or 1.0)
    return start, arrival, sign * direction


def _across(vector: Array, axis: Array) -> Array:
    """Unit vector of the part of a vector across an axis; another one across it where there is none."""
    part = vector - (vector @ axis) * axis
    if np.linalg.norm(part) < 1e-9:
        part = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    return np.asarray(part / np.linalg.norm(part))


def _frame(origin: Array, x: Array, z: Array) -> Array:
    return homogeneous(np.column_stack([x, np.cross(z, x), z]), origin)


def _turn(angle: float, axis: int) -> Array:
    return np.asarray(joint_motion("revolute", np.eye(3)[axis], np.asarray(angle)))
