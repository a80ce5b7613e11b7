"""Plays one motion after the other from the same pose; a recording that is cut short keeps its own name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from oed.campaigns.runs.homing import move_home
from oed.controllers import Endpoint, StreamOptions, StreamResult, stream
from oed.controllers.recording.clock import ClockAnchor
from oed.controllers.recording.pose import read_pose
from robots.collision import CollisionModel
from robots.common.progress import SILENT, Progress
from robots.robot import Robot
from robots.signals import Motion

Array = NDArray[np.float64]

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
