"""Plays one motion after the other from the same pose; a recording that is cut short keeps its own name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from oed.campaigns.clearances import CollisionFreeRanges
from oed.controllers import Endpoint, StreamOptions, StreamResult, stream
from oed.controllers.recording.clock import ClockAnchor
from oed.controllers.recording.pose import read_pose
from oed.retiming import plan_move
from oed.trajectories import PiecewisePolynomial
from robots.collision import CollisionModel, check_motion
from robots.common.arrays import Array
from robots.common.errors import InfeasibleError
from robots.common.progress import SILENT, Progress
from robots.limits import Limits
from robots.robot import Robot
from robots.signals import Motion

INTERRUPTED = "interrupted"


@dataclass(frozen=True, kw_only=True, eq=False)
class Player:
    """Plays motions that begin and end at home.

    Attributes:
        robot: the robot.
        home: pose (n,) [rad or m].
        endpoint: the controller.
        options: of the streams.
        folder: recordings go to its folder ``interrupted`` until they are complete.
        bodies: what has to stay apart on a move home; None for a move that is not checked.
        needs_torque: whether a controller without torque in its feedback is refused.
    """

    robot: Robot
    home: Array
    endpoint: Endpoint
    options: StreamOptions
    folder: Path
    bodies: CollisionModel | None = None
    needs_torque: bool = False

    def play(
        self,
        motion: Motion,
        name: str,
        header: Mapping[str, Any],
        *,
        anchor: ClockAnchor | None = None,
        file: str | PathLike[str] | None = None,
        progress: Progress = SILENT,
    ) -> tuple[StreamResult, ClockAnchor, Path]:
        """Plays a motion to its end.

        Args:
            motion: from home to home.
            name: of the recording.
            header: further entries of the log's header.
            anchor: the end of the log before.
            file: of the trajectory, for messages.
            progress: listener.

        Returns:
            What happened, the end of the log, and its file.

        Raises:
            InputError: see `stream`.
            LinkError: see `stream`.
            ControllerError: see `stream`.
        """
        recording = self._free_name(name)
        result = stream(
            motion,
            self.robot,
            self.endpoint,
            log=recording,
            options=self.options,
            header=header,
            anchor=anchor,
            needs_torque=self.needs_torque,
            file=file,
            progress=progress,
        )
        assert result.anchor is not None
        return result, result.anchor, recording

    def go_home(self, name: str, anchor: ClockAnchor | None, progress: Progress = SILENT) -> None:
        """Moves a robot that was stopped elsewhere back home, slowly.

        Args:
            name: of the recording, if the robot moves.
            anchor: the end of the log before.
            progress: listener.

        Raises:
            InfeasibleError: no way is proved free of collisions.
            LinkError: see `stream`.
            ControllerError: see `stream`.
        """
        pose = read_pose(self.robot, self.endpoint, self.options.patience)
        if np.abs(pose - self.home).max() <= self.options.start_tolerance:
            return
        motion = move_home(self.robot, pose, self.home, self.bodies)
        if motion is not None:
            self.play(motion, name, {"stage": "home"}, anchor=anchor, progress=progress)

    def _free_name(self, name: str) -> Path:
        """Gives the file of a recording that may be cut short; earlier ones are kept."""
        folder, attempt = self.folder / INTERRUPTED, 1
        folder.mkdir(exist_ok=True)
        while (folder / f"{name}_{attempt}.csv").exists():
            attempt += 1
        return folder / f"{name}_{attempt}.csv"


def move_home(robot: Robot, pose: Array, home: Array, bodies: CollisionModel | None) -> Motion | None:
    """Plans a slow move home on a way that is proved free of collisions.

    Args:
        robot: the robot.
        pose: where it stands (n,) [rad or m].
        home: where it has to go (n,).
        bodies: what has to stay apart on the way; None for a way that is not checked.

    Returns:
        The motion at the controller's period; None where the robot stands at home.

    Raises:
        InfeasibleError: no way is proved free, or the robot stands outside its position limits.
    """
    # Share of the velocity limits: a person may stand near a robot that was stopped.
    speed_share = 0.2
    limits = robot.limits.scaled(velocity=speed_share, acceleration=speed_share**2, jerk=speed_share**3)
    if bodies is None or not bodies.pairs:
        return _along((pose, home), limits, robot.period)
    for way in CollisionFreeRanges(bodies, home).ways(pose, home):
        motion = _along(way, limits, robot.period)
        if motion is None or check_motion(bodies, motion, confirm=False).certified:
            return motion
    raise InfeasibleError(
        "no way from where the robot stands to the home pose is proved free of collisions",
        remedy="move the robot home by hand, then start again",
    )


def _along(poses: tuple[Array, ...], limits: Limits, period: float) -> Motion | None:
    """Joins the moves between poses; each sample counts once."""
    joined: Motion | None = None
    for start, end in pairwise(poses):
        planned = plan_move(limits, start, end, period=period)
        if planned is None:
            continue
        pieces = PiecewisePolynomial(breakpoints=planned.breakpoints, coefficients=planned.coefficients)
        part = pieces.motion(period)
        if joined is not None:
            part = Motion.concatenate([joined, part.slice(1, None)], shift=True)
        joined = part
    return joined
