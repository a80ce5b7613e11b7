"""What files of experiments have in common: the robot that they are for, and what is assumed of it."""

from __future__ import annotations

from oed.experiments.results.design_file import DESIGN
from oed.experiments.safety_checks.margins import assumed_values
from robots.common.records import Result
from robots.robot import Robot

OF_ROBOT = ("robot.name=robot.name", "robot.origin=robot.origin", "robot.sha256=robot.digest")
"""Entries of a file that name the robot."""


class Planned(Result):
    """A planned experiment: its file names the robot."""

    FILE = DESIGN

    robot: Robot

    @property
    def assumed(self) -> list[str]:
        """What is assumed of the robot: values without a source, and limits that are not stated."""
        return assumed_values(self.robot)
