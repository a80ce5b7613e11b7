"""Plans the friction and warm-up stages: gentle enough for the torque limits, short enough for the cycle."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Sequence as Many
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from oed.campaigns.checking import TorqueCheck
from oed.campaigns.clearances import CollisionFreeRanges
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
from oed.trajectories.stage_defaults import LONGEST_PLATEAU
from robots.common.arrays import Array
from robots.common.errors import InfeasibleError
from robots.limits import Limits
from robots.robot import Robot
from robots.signals import Motion

SOFTER = (1.0, 0.85, 0.7, 0.5, 0.35, 0.2)
"""Shares of the acceleration and jerk limits that are tried in turn to keep the torque limits; speed is not reduced."""

VERTICAL_ANGLE = np.deg2rad(1.0)
"""Angle to the vertical up to which an axis counts as vertical."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Planner:
    """Plans stages of one robot about one home pose.

    Args:
        robot: the robot.
        limits: that all motions keep.
        home: pose at both ends of each stage, (n,) [rad or m].
        torque: the torque limits.
        free_ranges: keeps motions free of collisions, where the robot's bodies are known.
    """

    robot: Robot
    limits: Limits
    home: Array
    torque: TorqueCheck
    free_ranges: CollisionFreeRanges | None = None

    def poses(self) -> tuple[tuple[Array, float], ...]:
        """Chooses for each joint a pose in which gravity does no work on it, and the angle that is left [rad]."""
        return tuple(
            tuple(vertical_axis_pose(self.robot.chain, joint, self.limits, home=self.home, room=self._room(joint)))  # type: ignore[misc]
            for joint in range(1, self.robot.n + 1)
        )

    def _room(self, joint: int) -> Callable[[Array], float] | None:
        """Measures how far a joint can go from a pose before bodies meet."""
        free_ranges = self.free_ranges
        if free_ranges is None:
            return None

        def room(pose: Array) -> float:
            low, high = free_ranges.stretch(self.limits, joint, pose)
            return high - low

        return room

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
                box, part = (limits, fraction) if self.free_ranges is None else (self._box(limits, fraction), 1.0)
                warm_up = plan_warm_up(box, duration=rounded, period=period, fraction=part, duty=duty, centre=self.home)
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
                        "ranges": self._ranges(fraction),
                        "busy": busy.tolist(),
                        "acceleration_share": share,
                    },
                )
            )
        return tuple(stages)

    def _box(self, limits: Limits, fraction: float) -> Limits:
        """Gives limits the ranges in which the arm cannot meet itself or its surroundings."""
        assert self.free_ranges is not None
        if fraction not in self._boxes:
            self._boxes[fraction] = self.free_ranges.box(self.limits, fraction)
        box = self._boxes[fraction]
        return replace(limits, lower=box.lower, upper=box.upper)

    @cached_property
    def _boxes(self) -> dict[float, Limits]:
        return {}

    def _ranges(self, fraction: float) -> list[float]:
        """Gives which part of each joint's range a warm-up drives (n,)."""
        if self.free_ranges is None:
            return [fraction] * self.robot.n
        box, span = self._box(self.limits, fraction), self.limits.upper - self.limits.lower
        return np.where(
            np.isfinite(span), (box.upper - box.lower) / np.where(np.isfinite(span), span, 1.0), fraction
        ).tolist()

    def _sweep(self, limits: Limits, joint: int, pose: Array, levels: Many[float], longest: float) -> Sweep:
        period = self.robot.period
        if self.free_ranges is not None:
            lower, upper = limits.lower.copy(), limits.upper.copy()
            low, high = self.free_ranges.stretch(self.limits, joint, pose)
            # With no room there, the sweep is planned regardless, and the remarks say where it collides.
            if high > low:
                lower[joint - 1], upper[joint - 1] = low, high
                pose = pose.copy()
                pose[joint - 1] = np.clip(pose[joint - 1], low, high)
                limits = replace(limits, lower=lower, upper=upper)
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
        unit = self.limits.unit(worst.joint - 1, "torque")
        raise InfeasibleError(
            f"the {name} stage needs {abs(worst.value):.3g} {unit} even with low accelerations",
            joint=worst.joint,
            allowed=f"{usable:.3g}, the torque limit minus {100 * self.torque.margin:g} % reserve",
            remedy="reduce --velocity-fraction or --torque-margin",
        )

    def _joined(self, limits: Limits, parts: list[Segment]) -> Sequence:
        segments: list[Segment] = []
        here = self.home
        for part in parts:
            ends = part.trajectory.sample([0.0, part.trajectory.duration]).q
            segments += [*self.move(limits, here, ends[0]), part]
            here = ends[1]
        return Sequence(segments=(*segments, *self.move(limits, here, self.home)), period=self.robot.period)

    def move(self, limits: Limits, start: Array, end: Array) -> list[Segment]:
        """Moves from one pose to another, straight or, where bodies are in the way, around them if a way is found."""
        straight = self.stops(limits, (start, end))
        if self.free_ranges is None or not straight:
            return straight
        for poses in self.free_ranges.ways(start, end):
            segments = self.stops(limits, poses)
            motions = [segment.trajectory.motion(self.robot.period) for segment in segments]
            if all(self.free_ranges.free(motion) for motion in motions):
                return segments
        return straight

    def stops(self, limits: Limits, poses: Many[Array]) -> list[Segment]:
        """Moves from pose to pose, at rest at each."""
        segments = []
        for start, end in pairwise(poses):
            planned = plan_move(limits, start, end, period=self.robot.period)
            if planned is not None:
                pieces = PiecewisePolynomial(breakpoints=planned.breakpoints, coefficients=planned.coefficients)
                segments.append(Segment(kind="move", trajectory=pieces))
        return segments


def _plateau_data(plateau: Plateau, start: float) -> dict[str, float | int | bool]:
    return {
        "joint": plateau.joint,
        "speed": plateau.direction * plateau.speed,
        "asked": plateau.direction * plateau.asked,
        "start": start + plateau.start,
        "end": start + plateau.end,
    }
