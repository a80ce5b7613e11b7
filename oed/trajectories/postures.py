"""Static postures: the robot holds still in poses that turn gravity as differently as possible on each joint."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from oed.trajectories.base import Array, Kinematics, Trajectory, frozen
from robots.common.errors import InputError
from robots.geometry.chain import Chain
from robots.limits import Limits

CANDIDATES = 2048
"""Points of the Sobol sequence among which postures are chosen; a power of two, for which it is balanced."""

POSITION_WEIGHT = 0.1
"""Weight of a whole range of travel against a turn of gravity by one radian: it decides where gravity does not."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Posture(Trajectory):
    """One pose held for a time. The moves between postures are the caller's.

    Args:
        pose: (n,) [rad, or m].
        duration: how long [s].

    Raises:
        InputError: no joint, a number that is not finite, or a duration that is not positive.
    """

    pose: Array
    # Without a default the base class' property of this name would become one; zero is refused.
    duration: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "pose", frozen(self.pose, "pose", 1))
        if self.pose.size == 0:
            raise InputError("a pose of no joints", allowed="at least one joint")
        if not (np.isfinite(self.duration) and self.duration > 0):
            raise InputError(f"found a posture duration of {self.duration} s", allowed="a positive time")

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.pose.size

    def sample(self, t: ArrayLike) -> Kinematics:
        """Evaluates the posture, which is the same at all times.

        Args:
            t: times, (N,) [s].

        Returns:
            Position, and a velocity, acceleration and jerk of zero, each (N, n).
        """
        q = np.tile(self.pose, (np.asarray(t, dtype=np.float64).size, 1))
        return Kinematics(q, *np.zeros((3, *q.shape)))


def spread_postures(
    chain: Chain, limits: Limits, count: int, *, gravity: ArrayLike | None = None, reserve: float = 0.05
) -> Array:
    """Chooses poses within the limits that spread the directions of gravity, seen from every link, as far as possible.

    The pose nearest to the middle of the ranges comes first; then always the candidate that is farthest from all
    chosen ones (Gonzalez 1985: the smallest distance is at least half of the largest possible among the candidates). A
    candidate is described by gravity's direction in the frame of each link and, with a small weight, by its position in
    the range; candidates are a Sobol sequence. At last the poses are put in an order with short ways between them.

    Args:
        chain: the arm.
        limits: bounds of all joints; only positions count. A joint without end takes part within half a turn from zero.
        count: how many.
        gravity: (3,) [m/s^2] in the base frame; the chain's by default. Zero spreads positions alone.
        reserve: fraction of each range left free at either end, 0 to below 0.5.

    Returns:
        (count, n) poses [rad, or m]; the same for the same input.

    Raises:
        InputError: limits of another size, a count out of range, a reserve out of range, or a gravity of no direction.
    """
    if limits.n != chain.n:
        raise InputError(f"limits of {limits.n} joints", allowed=f"{chain.n}, as in the chain")
    if not 1 <= count <= CANDIDATES:
        raise InputError(f"found {count} postures", allowed=f"1 to {CANDIDATES}")
    if not 0.0 <= reserve < 0.5:
        raise InputError(f"found a reserve of {reserve} of each range", allowed="0 to below 0.5")
    down = frozen(chain.gravity if gravity is None else gravity, "gravity", 1)
    if down.shape != (3,):
        raise InputError(f"found a gravity of {down.size} numbers", allowed="three")
    lower, upper = _window(limits)
    from scipy.stats import qmc  # half a second to import, and needed here alone

    places = qmc.Sobol(d=chain.n, scramble=False).random(CANDIDATES)  # (C, n), 0 to 1
    poses = lower + (reserve + (1.0 - 2.0 * reserve) * places) * (upper - lower)
    features = np.hstack([_gravity_directions(chain, poses, down), POSITION_WEIGHT * places])
    chosen = [int(np.argmin(np.abs(places - 0.5).max(axis=1)))]
    nearest = np.linalg.norm(features - features[chosen[0]], axis=1)
    for _ in range(count - 1):
        chosen.append(int(np.argmax(nearest)))
        nearest = np.minimum(nearest, np.linalg.norm(features - features[chosen[-1]], axis=1))
    return poses[_in_short_order(places, chosen)]


def _gravity_directions(chain: Chain, poses: Array, down: Array) -> Array:
    """Unit vectors of gravity in each link's frame, (C, 3 n)."""
    length = np.linalg.norm(down)
    if length == 0.0:
        return np.zeros((poses.shape[0], 3 * chain.n))
    frames = chain.transforms(poses)[..., :3, :3]
    directions: Array = np.einsum("cnij,i->cnj", frames, down / length).reshape(poses.shape[0], -1)
    return directions


def _in_short_order(places: Array, chosen: list[int]) -> list[int]:
    """From the first to the nearest one left, and so on; the joint with the longest way sets the time of a move."""
    order, left = chosen[:1], chosen[1:]
    while left:
        ways = np.abs(places[left] - places[order[-1]]).max(axis=1)
        order.append(left.pop(int(np.argmin(ways))))
    return order


def _window(limits: Limits) -> tuple[Array, Array]:
    """The range of each joint; half a turn about zero, or next to the one limit, of a joint without end."""
    lower = np.where(np.isfinite(limits.lower), limits.lower, np.minimum(-np.pi, limits.upper - 2.0 * np.pi))
    upper = np.where(np.isfinite(limits.upper), limits.upper, np.maximum(np.pi, lower + 2.0 * np.pi))
    return np.where(np.isfinite(lower), lower, -np.pi), upper
