"""Plans the friction and warm-up stages: gentle enough for the torque limits, short enough for the cycle."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Sequence as Many
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from oed.campaigns.checking import TorqueCheck
from oed.campaigns.programme import duty_name
from oed.campaigns.stages import Stage
from oed.retiming import plan_move
from oed.trajectories import (
    PiecewisePolynomial,
    Plateau,
    Segment,
    Sequence,
    Sweep,
    friction_sweep,
    plan_warm_up,
    vertical_axis_pose,
)
from oed.trajectories.sweeps import LONGEST_PLATEAU
from robots.common.errors import InfeasibleError
from robots.limits import Limits
from robots.robot import Robot
from robots.signals import Motion

Array = NDArray[np.float64]

SOFTER = (1.0, 0.85, 0.7, 0.5, 0.35, 0.2)
"""Shares of the acceleration and jerk limits that are tried in turn to keep the torque limits; speed is not reduced."""

ALIGNED = np.deg2rad(1.0)
"""Angle to the vertical up to which an axis counts as vertical."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Planner:
    """Plans stages of one robot about one home pose.

    Args:
        robot: the robot.
        limits: that all motions keep.
        home: pose at both ends of each stage, (n,) [rad or m].
        torque: the torque limits.
    """

    robot: Robot
    limits: Limits
    home: Array
    torque: TorqueCheck

    def poses(self) -> tuple[tuple[Array, float], ...]:
        """Chooses for each joint a pose in which gravity does no work on it, and the angle that is left [rad]."""
        return tuple(
            tuple(vertical_axis_pose(self.robot.chain, joint, self.limits, home=self.home))  # type: ignore[misc]
            for joint in range(1, self.robot.n + 1)
        )

    def friction(self, poses: Many[tuple[Array, float]], levels: Many[float], longest: float) -> Stage:
        """Sweeps every joint at every level; the time at a level is the same for all levels of a joint.

        Args:
            poses: of each joint, and its axis' angle to where gravity does no work.
            levels: fractions of the velocity limits.
            longest: time at each level [s]; less where a joint's range is too short for it.

        Returns:
            The stage.

        Raises:
            InfeasibleError: a limit of zero, or torque limits that even soft accelerations pass.
        """

        def build(limits: Limits) -> Sequence:
            parts = [
                Segment(kind="friction", trajectory=self._sweep(limits, joint, pose, levels, longest), joint=joint)
                for joint, (pose, _) in enumerate(poses, start=1)
            ]
            return self._joined(limits, parts)

        sequence, motion, share = self._softest(build, "friction")
        plateaus: list[dict[str, float | int | bool]] = []
        for segment, start in zip(sequence.segments, sequence.boundaries, strict=False):
            if isinstance(segment.trajectory, Sweep):
                plateaus += [_plateau_data(plateau, float(start)) for plateau in segment.trajectory.plateaus]
        times = [
            min(p["end"] - p["start"] for p in plateaus if p["joint"] == joint) for joint in range(1, self.robot.n + 1)
        ]
        return Stage(
            name="friction",
            kind="friction",
            motion=motion,
            segments=tuple(sequence.table()),
            plateaus=tuple(plateaus),
            details={
                "levels": list(levels),
                "time_at_each_speed": times,
                "poses": [pose.tolist() for pose, _ in poses],
                "angle_to_no_gravity_deg": [float(np.rad2deg(angle)) for _, angle in poses],
                "acceleration_share": share,
            },
        )

    def warm_up(self, duration: float, duties: Many[float], fraction: float) -> tuple[Stage, ...]:
        """Warms up at full speed over a part of the ranges, at each duty cycle, all in stages of one length.

        Args:
            duration: of the warm-up between the moves from and to home [s].
            duties: fractions of the time in which joints move.
            fraction: part of each joint's range, about its middle.

        Returns:
            A stage per duty cycle.

        Raises:
            InputError: a duration that is too short for one stroke there and back.
            InfeasibleError: torque limits that even soft accelerations pass.
        """
        period, stages = self.robot.period, []
        rounded = round(duration / period) * period
        for duty in duties:

            def build(limits: Limits, duty: float = duty) -> Sequence:
                warm_up = plan_warm_up(
                    limits, duration=rounded, period=period, fraction=fraction, duty=duty, centre=self.home
                )
                return self._joined(limits, [Segment(kind="warm_up", trajectory=warm_up)])

            sequence, motion, share = self._softest(build, duty_name(duty))
            busy = next(s.trajectory.busy for s in sequence.segments if s.kind == "warm_up")  # type: ignore[attr-defined]
            stages.append(
                Stage(
                    name=duty_name(duty),
                    kind="warm_up",
                    motion=motion,
                    segments=tuple(sequence.table()),
                    details={
                        "duty": duty,
                        "time": rounded,
                        "range": fraction,
                        "busy": busy.tolist(),
                        "acceleration_share": share,
                    },
                )
            )
        return tuple(stages)

    def _sweep(self, limits: Limits, joint: int, pose: Array, levels: Many[float], longest: float) -> Sweep:
        period = self.robot.period
        free = friction_sweep(limits, joint, pose, period=period, levels=levels)
        common = min(plateau.duration for plateau in free.plateaus)
        # Where a joint's range allows no longer time at its highest speed, its other levels get the same.
        if common < LONGEST_PLATEAU - 1e-6 and longest >= common:
            return free
        return friction_sweep(limits, joint, pose, period=period, levels=levels, plateau=longest)

    def _softest(self, build: Callable[[Limits], Sequence], name: str) -> tuple[Sequence, Motion, float]:
        """Builds with ever softer accelerations until the torque limits hold; returns the share that did."""
        worst = None
        for share in SOFTER:
            sequence = build(self.limits.scaled(acceleration=share, jerk=share))
            motion = sequence.motion()
            if self.torque.keeps(motion):
                return sequence, motion, share
            worst = self.torque.worst(motion)
        assert worst is not None
        usable = (1.0 - self.torque.margin) * worst.limit
        raise InfeasibleError(
            f"the {name} stage takes {abs(worst.value):.4g} of torque even with soft accelerations",
            joint=worst.joint,
            allowed=f"{usable:.4g}, the torque limit less {100 * self.torque.margin:g} %",
            remedy="lower the velocity fraction",
        )

    def _joined(self, limits: Limits, parts: list[Segment]) -> Sequence:
        segments: list[Segment] = []
        here = self.home
        for part in parts:
            ends = part.trajectory.sample([0.0, part.trajectory.duration]).q
            segments += [*self._move(limits, here, ends[0]), part]
            here = ends[1]
        return Sequence(segments=(*segments, *self._move(limits, here, self.home)), period=self.robot.period)

    def _move(self, limits: Limits, start: Array, end: Array) -> list[Segment]:
        planned = plan_move(limits, start, end, period=self.robot.period)
        if planned is None:
            return []
        pieces = PiecewisePolynomial(breakpoints=planned.breakpoints, coefficients=planned.coefficients)
        return [Segment(kind="move", trajectory=pieces)]


def _plateau_data(plateau: Plateau, start: float) -> dict[str, float | int | bool]:
    return {
        "joint": plateau.joint,
        "speed": plateau.direction * plateau.speed,
        "asked": plateau.direction * plateau.asked,
        "start": start + plateau.start,
        "end": start + plateau.end,
    }
