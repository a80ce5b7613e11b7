"""What a form of a trajectory is: bytes for a file, and the way back where there is one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import ClassVar

from oed.exports.options import ExportOptions
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.robot import Robot
from robots.signals import Motion

NANOSECONDS = 1_000_000_000  # of a second


class Form(ABC):
    """One form of a trajectory.

    Attributes:
        name: as ``--to`` takes it.
        suffixes: of the file, the usual one first.
        period: sample period that the controller needs [s]; None for that of the trajectory.
        has_samples: whether the file holds the trajectory, and not only limits of its robot.
        named: whether the file must have the name of its program or module.
        program: that name, where none is stated.
        comment: what begins a comment in files of each suffix that has comments.
    """

    name: ClassVar[str]
    suffixes: ClassVar[tuple[str, ...]]
    period: ClassVar[float | None] = None
    has_samples: ClassVar[bool] = True
    named: ClassVar[bool] = False
    program: ClassVar[str] = "trajectory"
    comment: ClassVar[Mapping[str, str]] = {}

    def content(self, motion: Motion, robot: Robot, options: ExportOptions, suffix: str) -> bytes:
        """Gives the content of the file, with the remark as a comment below its first line; see `write`."""
        whole, begin = self.write(motion, robot, options, suffix), self.comment.get(suffix)
        if not (begin and options.remark):
            return whole
        first, _, rest = whole.partition(b"\n")
        return b"\n".join([first, f"{begin} {options.remark}".encode("ascii", "replace"), rest])

    def period_of(self, robot: Robot) -> float | None:
        """Gives the sample period that the controller of a robot needs [s]; None for that of the trajectory."""
        return self.period

    @abstractmethod
    def write(self, motion: Motion, robot: Robot, options: ExportOptions, suffix: str) -> bytes:
        """Gives the content of the file.

        Args:
            motion: at the controller's period.
            robot: whose joints move.
            options: choices of the user.
            suffix: of the file, one of `suffixes`.

        Raises:
            InputError: a robot that this controller cannot have.
        """

    def read(self, content: bytes, robot: Robot, suffix: str) -> tuple[Array, Array]:
        """Reads times (N,) [s] and positions (N, n) [rad or m] back.

        Raises:
            InputError: this form holds no points, or the content is not of it.
        """
        raise InputError(f"a file of the form {self.name} cannot be read back")


def require_joints(robot: Robot, least: int, most: int, what: str) -> None:
    """Refuses a robot with another number of joints, or with linear axes.

    Raises:
        InputError: naming the robot.
    """
    if not least <= robot.n <= most:
        allowed = f"{least}" if least == most else f"{least} to {most}"
        raise InputError(f"{robot.name} has {robot.n} joints", allowed=f"{allowed}, as {what} takes")
    for joint, item in enumerate(robot.chain.joints, start=1):
        if item.kind == "prismatic":
            raise InputError(f"{robot.name} has a linear axis", joint=joint, allowed=f"revolute joints for {what}")


def number(value: float, digits: int = 9) -> str:
    """Writes a number with a decimal point and without exponent."""
    text = f"{value:.{digits}f}".rstrip("0")
    text = text + "0" if text.endswith(".") else text
    return "0.0" if text == "-0.0" else text
