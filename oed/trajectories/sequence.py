"""A whole experiment as one trajectory: segments one after the other, joined without a jump."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from oed.trajectories.base import Array, Kinematics, Trajectory, count_periods
from robots.common.errors import InputError
from robots.signals import Motion

KINDS = ("approach", "fourier", "excitation", "sinusoid", "friction", "warm_up", "move", "pose")
"""The kinds of segment a design file may name."""

POSITION_TOLERANCE = 1e-9
"""Largest jump of position where two segments meet [rad]: a thousandth of the step of a 22-bit encoder."""

VELOCITY_TOLERANCE = 1e-7
"""Largest jump of velocity where two segments meet [rad/s]."""

ACCELERATION_TOLERANCE = 1e-5
"""Largest jump of acceleration where two segments meet [rad/s^2]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Segment:
    """A part of an experiment.

    Args:
        kind: one of `KINDS`.
        trajectory: its motion.
        joint: the joint it is about, counted from 1, or None.

    Raises:
        InputError: the kind is unknown.
    """

    kind: str
    trajectory: Trajectory
    joint: int | None = None

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise InputError(f"found the segment kind {self.kind!r}", allowed=", ".join(KINDS))


@dataclass(frozen=True, kw_only=True, eq=False)
class Sequence(Trajectory):
    """Segments one after the other, each lasting a whole number of controller periods.

    Args:
        segments: in order.
        period: the controller's period [s].

    Raises:
        InputError: no segments, numbers of joints that differ, a duration that is no multiple of the period, or a jump
            of position, velocity or acceleration between two segments.
    """

    segments: tuple[Segment, ...]
    period: float
    boundary_indices: NDArray[np.int64] = field(init=False, repr=False)
    """Sample indices at which segments start, and that of the last sample, (S+1,)."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "segments", tuple(self.segments))
        if not self.segments:
            raise InputError("an experiment without segments", allowed="at least one segment")
        sizes = [segment.trajectory.n for segment in self.segments]
        if len(set(sizes)) > 1:
            raise InputError(f"segments of {sizes} joints", allowed="the same number in all")
        counts = [count_periods(segment.trajectory.duration, self.period) for segment in self.segments]
        object.__setattr__(self, "boundary_indices", np.concatenate([[0], np.cumsum(counts)]))
        self._check_joints()

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.segments[0].trajectory.n

    @property
    def duration(self) -> float:
        """Duration in s."""
        return float(self.boundaries[-1])

    @property
    def boundaries(self) -> Array:
        """Times at which segments start, and the end of the last, (S+1,) [s]."""
        return self.period * self.boundary_indices.astype(np.float64)

    def sample(self, t: ArrayLike) -> Kinematics:
        """Evaluates the segments; a time outside the duration takes the value at the nearer end.

        Args:
            t: times, (N,) [s], in any order.

        Returns:
            Position, velocity, acceleration and jerk, each (N, n); where two segments meet, that of the later.
        """
        times = np.clip(np.asarray(t, dtype=np.float64), 0.0, self.duration)
        boundaries = self.boundaries
        index = np.clip(np.searchsorted(boundaries, times, side="right") - 1, 0, len(self.segments) - 1)
        result = Kinematics(*np.empty((4, times.size, self.n)))
        for number, segment in enumerate(self.segments):
            here = index == number
            if np.any(here):
                parts = segment.trajectory.sample(times[here] - boundaries[number])
                for whole, part in zip(result, parts, strict=True):
                    whole[here] = part
        return result

    def motion(self, period: float | None = None) -> Motion:
        """Samples the whole experiment, by default at its own period.

        Args:
            period: sample period [s].

        Returns:
            The motion, both ends included.
        """
        return super().motion(self.period if period is None else period)

    def table(self) -> list[dict[str, object]]:
        """Lists the segments as the design file does.

        Returns:
            One entry per segment: kind, start [s], end [s], joint (from 1, or None).
        """
        times = self.boundaries
        return [
            {"kind": segment.kind, "start": float(start), "end": float(end), "joint": segment.joint}
            for segment, start, end in zip(self.segments, times[:-1], times[1:], strict=True)
        ]

    def _check_joints(self) -> None:
        checks = (
            ("position", "rad or m", POSITION_TOLERANCE),
            ("velocity", "rad/s or m/s", VELOCITY_TOLERANCE),
            ("acceleration", "rad/s2 or m/s2", ACCELERATION_TOLERANCE),
        )
        for number, (before, after) in enumerate(pairwise(self.segments), start=1):
            end = before.trajectory.sample([before.trajectory.duration])
            start = after.trajectory.sample([0.0])
            for (name, unit, tolerance), left, right in zip(checks, end, start, strict=False):
                jumps = np.abs(right[0] - left[0])
                worst = int(np.argmax(jumps))
                if jumps[worst] > tolerance:
                    raise InputError(
                        (
                            f"the {name} jumps by {jumps[worst]:.3g} {unit} between segments {number} ({before.kind}) "
                            f"and {number + 1} ({after.kind})"
                        ),
                        joint=worst + 1,
                        allowed=f"{tolerance:g} {unit}",
                        remedy="insert a move between them",
                    )
