"""Constant-speed sweeps: one joint over its whole range at each of several speeds, slow to fast, both ways."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from oed.trajectories.base import Array
from oed.trajectories.ramps import ENDLESS_RANGE, checked_pose, joint_bounds
from oed.trajectories.sweeps import SHORTEST_PLATEAU, Sweep, Travel, sweep_over
from robots.common.errors import InputError
from robots.limits import Limits


def constant_speed_sweep(
    limits: Limits,
    joint: int,
    pose: ArrayLike,
    *,
    speeds: Sequence[float] | Array,
    period: float,
    fraction: float = 1.0,
    pause: float = 0.0,
) -> Sweep:
    """Drives one joint over its range and back at each speed, the slowest first.

    If the range is too short to keep a speed for `SHORTEST_PLATEAU`, the speed is reduced; see the plateaus.

    Args:
        limits: bounds of all joints.
        joint: the joint that moves, counted from 1.
        pose: (n,) [rad]: where the other joints hold, and about which an endless joint turns.
        speeds: [rad/s], above 0 and up to the velocity limit; see `spaced_speeds`.
        period: the controller's period [s].
        fraction: how much of the range is used, about its middle; an endless joint's range is one turn.
        pause: rest at each turn [s].

    Returns:
        The sweep, at rest at both ends, each stroke starting on a controller period.

    Raises:
        InputError: no such joint, a pose outside, speeds, a fraction, a pause or a period out of range, or a limit
            that is missing.
        InfeasibleError: a limit of zero.
    """
    bounds, centre = joint_bounds(limits, joint), checked_pose(limits, pose)
    wanted = np.sort(np.asarray(speeds, dtype=np.float64).ravel())
    highest = float(limits.velocity[joint - 1])
    if wanted.size == 0 or not np.all((wanted > 0.0) & (wanted <= highest)):
        raise InputError(
            f"found the speeds {np.array2string(wanted, precision=6)}",
            joint=joint,
            allowed=f"above 0 and up to the velocity limit, {highest:.6g} rad/s",
        )
    lower, upper = used_range(bounds.lower, bounds.upper, float(centre[joint - 1]), fraction, joint)
    travels = []
    for asked in np.minimum(wanted, bounds.velocity):
        speed = min(float(asked), bounds.highest_speed(upper - lower, SHORTEST_PLATEAU))
        travels.append(Travel(asked=float(asked), speed=speed, lower=lower, upper=upper, shortened=bool(speed < asked)))
    return sweep_over(bounds, joint, centre, travels, period=period, pause=pause)


def used_range(lower: float, upper: float, centre: float, fraction: float, joint: int) -> tuple[float, float]:
    """The part of a joint's range that a motion uses, about the middle.

    Args:
        lower: lowest position [rad].
        upper: highest position [rad].
        centre: about which a joint without limits on both sides turns [rad].
        fraction: of the range, above 0 and up to 1.
        joint: counted from 1, for the error message.

    Returns:
        Where it starts and where it turns [rad].

    Raises:
        InputError: a fraction out of range.
    """
    if not 0.0 < fraction <= 1.0:
        raise InputError(f"found {fraction} of the range", joint=joint, allowed="a fraction above 0 and up to 1")
    if not np.isfinite(upper - lower):
        half = ENDLESS_RANGE / 2.0
        # A limit on one side pushes the turn away from it.
        centre = float(np.clip(centre, lower + half, upper - half))
        lower, upper = centre - half, centre + half
    inset = (1.0 - fraction) * (upper - lower) / 2.0
    return lower + inset, upper - inset


def spaced_speeds(lowest: float, highest: float, count: int, *, logarithmic: bool = True) -> Array:
    """Spaces speeds evenly, by default on a logarithmic scale: friction changes most where a joint is slow.

    Args:
        lowest: [rad/s], above zero.
        highest: [rad/s], above the lowest.
        count: how many, at least 2.
        logarithmic: equal ratios instead of equal steps.

    Returns:
        The speeds, (count,) [rad/s], both ends exact.

    Raises:
        InputError: speeds that are not positive and increasing, or a count below 2.
    """
    if not (0.0 < lowest < highest < np.inf) or count < 2:
        raise InputError(
            f"found {count} speeds from {lowest} to {highest} rad/s", allowed="at least 2, from above 0 to a higher one"
        )
    speeds = np.geomspace(lowest, highest, count) if logarithmic else np.linspace(lowest, highest, count)
    speeds[[0, -1]] = lowest, highest
    return speeds
