"""Poses in which gravity does no work on the joint that is measured: its axis stands vertical."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares

from oed.trajectories.base import Array, frozen
from oed.trajectories.ramps import checked_pose
from robots.common.errors import InputError
from robots.geometry.chain import Chain
from robots.limits import Limits

SCAN = np.deg2rad([-90.0, -45.0, 0.0, 45.0, 90.0])
"""Angles from home at which each joint is tried: axes of industrial arms meet at right angles."""

SIDE_WEIGHT = 1e-5
"""Weight of one radian from the start of the refinement: joints that do not matter stay there."""

ROOM_SHARE = 0.5
"""Part of the most room that a pose must leave the joint."""

ALIGNED_ANGLE = 1e-6
"""Misalignment that makes no difference [rad]: a millionth of the weight is left to act on the joint."""


class AxisPose(NamedTuple):
    """A pose and how well it does.

    Args:
        pose: (n,) [rad, or m].
        angle: between the axis and the direction it should have [rad], 0 to pi/2.
    """

    pose: Array
    angle: float


def vertical_axis_pose(
    chain: Chain,
    joint: int,
    limits: Limits,
    gravity: ArrayLike | None = None,
    *,
    home: ArrayLike | None = None,
    room: Callable[[Array], float] | None = None,
) -> AxisPose:
    """Poses the other joints so that gravity does no work on one joint, as far as the arm allows.

    The axis of a revolute joint is made vertical, either way up; that of a prismatic joint horizontal. Only the
    revolute joints before it turn its axis; all others stay at home. They are scanned in steps of 45 degrees about
    home, and the best poses polished by least squares on the exact kinematics. Of equally good ones that is taken
    which moves the fewest joints, moves them least, and rather the wrist than the shoulder. The same input gives the
    same pose.

    Args:
        chain: the arm.
        joint: the joint to measure, counted from 1.
        limits: bounds of all joints; only positions count.
        gravity: (3,) [m/s^2] in the base frame; the chain's by default.
        home: (n,) preferred pose [rad]; by default zero, or the middle of a range without zero.
        room: how far the joint can go from a pose (n,) without meeting anything [rad or m]; poses that leave it less
            than `ROOM_SHARE` of the most that any leaves are not taken.

    Returns:
        The pose and the angle that is left: 0 where gravity has no effect, pi/2 where the axis can only lie.

    Raises:
        InputError: no such joint, limits of another size, a home pose outside of them, or no gravity.
    """
    if not 1 <= joint <= chain.n:
        raise InputError("the joint does not exist", joint=joint, allowed=f"1 to {chain.n}")
    if limits.n != chain.n:
        raise InputError(f"limits of {limits.n} joints", allowed=f"{chain.n}, as in the chain")
    down = frozen(chain.gravity if gravity is None else gravity, "gravity", 1)
    if down.shape != (3,) or not np.linalg.norm(down) > 0.0:
        raise InputError(f"found the gravity {down} m/s^2", allowed="three numbers, not all zero")
    start = checked_pose(limits, limits.home if home is None else home, "home pose")
    search = _Search(chain, joint - 1, down / np.linalg.norm(down), start, limits)
    return search.best(room)


class _Search:
    """The scan and the polish, over the joints that turn the axis."""

    def __init__(self, chain: Chain, index: int, down: Array, home: Array, limits: Limits) -> None:
        self._chain, self._index, self._down, self._home = chain, index, down, home
        self._free = np.array([k for k in range(index) if chain.kinds[k] == "revolute"], dtype=np.int64)
        self._lower, self._upper = limits.lower[self._free], limits.upper[self._free]
        # Extra weight of a joint's way for each joint after it: a wrist sweeps less room than a shoulder.
        self._weights = 1.0 + 0.01 * np.arange(chain.n - 1, -1, -1)
        self._linear = chain.kinds[index] == "prismatic"

    def best(self, room: Callable[[Array], float] | None) -> AxisPose:
        candidates = [self._home[self._free]]
        if self._free.size:
            candidates += [self._polished(start) for start in self._scanned()]
        poses = self._poses(np.array(candidates))
        if room is not None:
            rooms = np.array([room(pose) for pose in poses])
            poses = poses[rooms >= ROOM_SHARE * rooms.max()]
        angles = self._angles(poses)
        ways = np.abs(poses - self._home)
        # Way from home that counts as moving a joint.
        moved = (ways > np.deg2rad(1.0)).sum(axis=1)
        first = int(np.lexsort(((ways @ self._weights).round(6), moved, (angles / ALIGNED_ANGLE).round()))[0])
        pose = poses[first]
        pose.setflags(write=False)
        return AxisPose(pose=pose, angle=float(angles[first]))

    def _scanned(self) -> Array:
        around = self._home[self._free, None] + SCAN
        options = [
            np.unique(np.clip(row, low, high)) for row, low, high in zip(around, self._lower, self._upper, strict=True)
        ]
        grid = np.stack(np.meshgrid(*options, indexing="ij"), axis=-1).reshape(-1, self._free.size)
        ways = np.abs(grid - self._home[self._free])
        far = ways @ self._weights[self._free] + (ways > 0.0).sum(axis=1)
        # Weight of one radian from home against one radian of misalignment, in the scan.
        costs = self._angles(self._poses(grid)) + 1e-3 * far
        # Scanned poses from which the solution is sought.
        return grid[np.argsort(costs.round(9), kind="stable")[:12]]

    def _polished(self, start: Array) -> Array:
        if self._angles(self._poses(start[None]))[0] < ALIGNED_ANGLE:
            return start
        box = (self._lower, self._upper)
        tight: dict[str, Any] = {"xtol": 1e-15, "gtol": 1e-15, "ftol": 1e-15}
        return least_squares(self._residual, start, self._jacobian, bounds=box, args=(start,), **tight).x

    def _poses(self, free: Array) -> Array:
        poses = np.tile(self._home, (free.shape[0], 1))
        poses[:, self._free] = free
        return poses

    def _axes(self, poses: Array) -> Array:
        """Axes of all joints in the base frame, (..., n, 3): a joint does not turn its own axis."""
        frames = self._chain.transforms(poses)[..., :3, :3]
        return np.einsum("...kij,kj->...ki", frames, np.stack([joint.axis for joint in self._chain.joints]))

    def _angles(self, poses: Array) -> Array:
        axis = self._axes(poses)[..., self._index, :]
        across, along = np.linalg.norm(np.cross(axis, self._down), axis=-1), np.abs(axis @ self._down)
        angle: Array = np.arctan2(along, across) if self._linear else np.arctan2(across, along)
        return angle

    def _residual(self, free: Array, start: Array) -> Array:
        axis = self._axes(self._poses(free[None])[0])[self._index]
        miss = np.atleast_1d(axis @ self._down) if self._linear else np.cross(axis, self._down)
        return np.concatenate([miss, SIDE_WEIGHT * (free - start)])

    def _jacobian(self, free: Array, start: Array) -> NDArray[np.float64]:
        axes = self._axes(self._poses(free[None])[0])
        turned = np.cross(axes[self._free], axes[self._index])  # d axis / d q_k, (K, 3)
        miss = (turned @ self._down)[None] if self._linear else np.cross(turned, self._down).T
        return np.vstack([miss, SIDE_WEIGHT * np.eye(self._free.size)])
