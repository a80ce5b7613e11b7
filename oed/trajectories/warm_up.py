"""The warm-up: all joints back and forth at full speed at once, each in its own time (thesis section 2.4.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from oed.trajectories.base import Array, Kinematics, Trajectory, count_periods, frozen
from oed.trajectories.polynomial import PiecewisePolynomial
from oed.trajectories.ramps import Profile, checked_pose, fill, joined, joint_bounds, stroke, used_range
from oed.trajectories.stage_defaults import RANGE_FRACTION
from robots.common.errors import InputError
from robots.limits import Limits


@dataclass(frozen=True, kw_only=True, eq=False)
class WarmUp(Trajectory):
    """Blocks of a move and a pause; in the move each joint repeats its own cycle a whole number of times.

    Args:
        cycles: one cycle of each joint, each a trajectory of one joint that ends where it starts, at rest.
        repeats: how often each joint repeats its cycle in one move, (n,).
        starts: when blocks start, and the end of the last, (B+1,) [s].
        move: how long the move at the beginning of each block lasts [s]; that of every cycle times its repeats.
        busy: fraction of the whole duration in which each joint moves, (n,).
        swing: travel of each joint's stroke, (n,) [rad].
        speeds: largest speed of each joint, (n,) [rad/s].

    Raises:
        InputError: no joint, or numbers that do not fit one another.
    """

    cycles: tuple[PiecewisePolynomial, ...]
    repeats: tuple[int, ...]
    starts: Array
    move: float
    busy: Array
    swing: Array
    speeds: Array

    def __post_init__(self) -> None:
        for name in ("starts", "busy", "swing", "speeds"):
            object.__setattr__(self, name, frozen(getattr(self, name), name, 1))
        object.__setattr__(self, "cycles", tuple(self.cycles))
        object.__setattr__(self, "repeats", tuple(self.repeats))
        if not self.cycles or len(self.repeats) != len(self.cycles):
            raise InputError(
                f"found {len(self.repeats)} repeats for {len(self.cycles)} joints", allowed="one per joint"
            )
        for joint, (cycle, repeats) in enumerate(zip(self.cycles, self.repeats, strict=True), start=1):
            if cycle.n != 1 or abs(cycle.duration * repeats - self.move) > 1e-9 * self.move:
                raise InputError(
                    f"{repeats} cycles of {cycle.duration:.9g} s do not fill a move of {self.move:.9g} s", joint=joint
                )
        if self.starts.size < 2 or self.starts[0] != 0.0 or np.any(np.diff(self.starts) < self.move * (1.0 - 1e-9)):
            raise InputError(f"found blocks at {self.starts} s, shorter than their move of {self.move:.9g} s")

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.cycles)

    @property
    def duration(self) -> float:
        """Duration in s."""
        return float(self.starts[-1])

    @property
    def mean_duty(self) -> float:
        """Fraction of time in which a joint moves, the mean over joints and over the whole duration."""
        return float(self.busy.mean())

    def sample(self, t: ArrayLike) -> Kinematics:
        """Evaluates the warm-up; a time outside the duration takes the value at the nearer end.

        Args:
            t: times, (N,) [s].

        Returns:
            Position, velocity, acceleration and jerk, each (N, n); where the jerk jumps, that of the later piece.
        """
        times = np.clip(np.asarray(t, dtype=np.float64), 0.0, self.duration)
        block = np.clip(np.searchsorted(self.starts, times, side="right") - 1, 0, self.starts.size - 2)
        local = times - self.starts[block]
        whole = Kinematics(*np.zeros((4, times.size, self.n)))
        for column, cycle in enumerate(self.cycles):
            # In the pause the time stands at the start of a cycle, where the joint rests.
            turn = np.where(local < self.move, local / cycle.duration, 0.0)
            values = cycle.sample((turn - np.floor(turn)) * cycle.duration)
            for target, value in zip(whole, values, strict=True):
                target[:, column] = value[:, 0]
        pausing = local >= self.move
        for rate in whole[1:]:
            rate[pausing] = 0.0
        return whole


def plan_warm_up(
    limits: Limits,
    *,
    duration: float,
    period: float,
    fraction: float = RANGE_FRACTION,
    duty: float = 1.0,
    block: float = 30.0,
    centre: ArrayLike | None = None,
) -> WarmUp:
    """Plans a warm-up of all joints at full speed over a part of their ranges, back and forth.

    Each joint moves as fast as its velocity, acceleration and jerk limits allow, for as many whole cycles as fit. The
    remaining time is distributed evenly over its reversals; speed and travel are not reduced. All joints start and end
    together at the lower ends of their strokes.

    Args:
        limits: bounds of all joints.
        duration: of the whole [s], a multiple of the period.
        period: the controller's period [s].
        fraction: of each joint's range, about its middle; an endless joint's range is one turn.
        duty: fraction of time in which joints move, above 0 and up to 1: 0.2, 0.4, 0.6 and 1 in the thesis. Below 1 the
            length of the moves is chosen so that the joints' own fractions, turns excluded, come closest to it in the
            mean square: see `WarmUp.busy` and `mean_duty`.
        block: about how long a move and its pause last [s], longer where the slowest joint needs that for one cycle; at
            full duty there is one block only.
        centre: (n,) [rad] about which endless joints turn; zero by default.

    Returns:
        The warm-up, at rest at both ends.

    Raises:
        InputError: a duration that is no multiple of the period or too short for one cycle, numbers out of range, or a
            limit that is missing.
        InfeasibleError: a limit of zero.
    """
    if not 0.0 < duty <= 1.0:
        raise InputError(f"found the duty cycle {duty}", allowed="a fraction above 0 and up to 1")
    if not (np.isfinite(block) and block > 0.0 and np.isfinite(duration) and duration > 0.0):
        raise InputError(f"found blocks of {block} s in {duration} s", allowed="positive times")
    total = count_periods(duration, period)
    pose = np.zeros(limits.n) if centre is None else checked_pose(limits, centre, "centre")
    strokes = [_strokes(limits, joint, float(pose[joint - 1]), fraction) for joint in range(1, limits.n + 1)]
    shortest = np.array([2.0 * there.duration for there, _ in strokes])  # one cycle of each joint [s]
    slowest = int(shortest.argmax())
    if shortest[slowest] > duty * duration + period:
        raise InputError(
            f"one cycle takes {shortest[slowest]:.6g} s, more than {duty:.3g} of {duration:.6g} s",
            joint=slowest + 1,
            remedy=f"let the warm-up last {shortest[slowest] / duty:.6g} s",
        )
    blocks = 1 if duty == 1.0 else max(1, int(duration / max(block, shortest[slowest] / duty)))
    starts = np.rint(np.linspace(0.0, total, blocks + 1))  # [periods]
    moving = _best_move(shortest, duty * duration / blocks, int(np.diff(starts).min()), period) if duty < 1.0 else total
    move = moving * period
    repeats = (move / shortest + 1e-9).astype(np.int64)
    if np.any(repeats == 0):
        raise InputError(f"one cycle takes {shortest[slowest]:.6g} s, a block has {move:.6g} s", joint=slowest + 1)
    cycles = []
    for (there, back), count in zip(strokes, repeats, strict=True):
        half = move / (2 * count)
        cycles.append(joined([(0.0, fill(there, half)), (half, fill(back, half))], 2.0 * half))
    return WarmUp(
        cycles=tuple(cycles),
        repeats=tuple(int(count) for count in repeats),
        starts=period * starts,
        move=move,
        busy=blocks * repeats * shortest / duration,
        swing=np.array([back.coefficients[0, 0] - there.coefficients[0, 0] for there, back in strokes]),
        speeds=np.array([there.coefficients[:, 1].max() for there, _ in strokes]),
    )


def _strokes(limits: Limits, joint: int, centre: float, fraction: float) -> tuple[Profile, Profile]:
    bounds = joint_bounds(limits, joint)
    lower, upper = used_range(bounds.lower, bounds.upper, centre, fraction, joint)
    speed = bounds.highest_speed(upper - lower)
    return stroke(bounds, lower, upper, speed)[0], stroke(bounds, upper, lower, speed)[0]


def _best_move(cycles: Array, wanted: float, longest: int, period: float) -> int:
    """The length of a move [periods] in which whole cycles keep the joints busy for the wanted time, on average."""
    least = int(np.ceil(cycles.max() / period - 1e-9))
    ends = [np.ceil(cycle / period * np.arange(1, longest * period / cycle + 1.0) - 1e-9) for cycle in cycles]
    lengths = np.unique(np.concatenate([[least], *ends]))
    lengths = lengths[(lengths >= least) & (lengths <= max(longest, least))]
    busy = np.floor(lengths[:, None] * period / cycles + 1e-9) * cycles  # (L, n) [s]
    return int(lengths[np.argmin(((busy - wanted) ** 2).sum(axis=1))])
