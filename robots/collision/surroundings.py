"""What stands around a robot, as a user states it: one choice for every motion that is planned or checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robots.collision.boxes import Box, Scene
from robots.collision.loading import collision_model
from robots.collision.model import CollisionModel
from robots.common.errors import InputError
from robots.robot import Robot


@dataclass(frozen=True, kw_only=True)
class Surroundings:
    """The floor, and boxes that the arm must not enter, beside what the robot's file states.

    Attributes:
        floor: its height in the base frame [m]; True is that of the robot's file, else the plane that the base is
            mounted on; False is none.
        keep_out: the boxes.

    Raises:
        InputError: a height that is not finite.
    """

    floor: float | bool = True
    keep_out: Sequence[Box] = ()

    def __post_init__(self) -> None:
        if not np.isfinite(self.floor):
            raise InputError(f"a floor at {self.floor} m", allowed="a finite height, or none")

    def model(self, robot: Robot) -> CollisionModel:
        """Makes the bodies and obstacles that have to stay apart.

        Args:
            robot: the robot.

        Raises:
            InputError: see `collision_model`.
        """
        return collision_model(robot, floor=self.floor, scene=Scene(obstacles=tuple(self.keep_out)))

    def settings(self) -> dict[str, Any]:
        """Writes them as plain data."""
        boxes = [{"name": box.name, "size": box.size.tolist(), "pose": box.pose.tolist()} for box in self.keep_out]
        return {"floor": self.floor, "keep_out": boxes}

    @classmethod
    def between(cls, floor: float | bool, corners: Sequence[Sequence[float]]) -> Surroundings:
        """Makes surroundings of boxes that are stated by their corners.

        Args:
            floor: see `Surroundings`.
            corners: of each box, from and to in x, y and z in the base frame [m].

        Raises:
            InputError: numbers that are not finite, or an empty box.
        """
        boxes = []
        for number, sides in enumerate(corners, start=1):
            low, high = np.array(sides[::2]), np.array(sides[1::2])
            if not (np.isfinite(low) & np.isfinite(high) & (low < high)).all():
                stated = ",".join(f"{side:g}" for side in sides)
                raise InputError(f"--keep-out {stated}", allowed="finite numbers, each minimum below its maximum")
            pose = np.eye(4)
            pose[:3, 3] = (low + high) / 2.0
            boxes.append(Box(name=f"keep-out {number}", size=high - low, pose=pose))
        return cls(floor=floor, keep_out=tuple(boxes))

    @classmethod
    def from_settings(cls, data: Mapping[str, Any]) -> Surroundings:
        """Reads what `settings` wrote; what older files do not state is the default."""
        boxes = [
            Box(name=box["name"], size=np.array(box["size"]), pose=np.array(box["pose"]))
            for box in data.get("keep_out", ())
        ]
        return cls(floor=data.get("floor", True), keep_out=tuple(boxes))
