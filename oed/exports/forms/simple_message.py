"""A replay of the simple_message protocol: the frames of a stream, one behind the other."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from oed.exports.forms.base import Array, ExportOptions, Form
from oed.exports.simple_message import DEFAULT, Comm, Frame, FullPoint, Splitter, trajectory_points
from robots.common.errors import InputError, OedError
from robots.robot import Robot
from robots.signals import Motion


class SimpleMessageReplay(Form):
    """JOINT_TRAJ_PT_FULL requests in order: little-endian, reals of 4 bytes."""

    name: ClassVar[str] = "simple-message"
    suffixes: ClassVar[tuple[str, ...]] = (".bin",)

    def write(self, motion: Motion, robot: Robot, options: ExportOptions, suffix: str) -> bytes:
        """See `Form.write`."""
        return b"".join(DEFAULT.encode(Frame(point, Comm.REQUEST)) for point in trajectory_points(motion))

    def read(self, content: bytes, robot: Robot, suffix: str) -> tuple[Array, Array]:
        """See `Form.read`; numbers have the precision of 4 bytes."""
        try:
            points = [DEFAULT.decode(frame).message for frame in Splitter(DEFAULT).feed(content)]
        except OedError as error:
            raise InputError(f"no simple_message frames ({error})") from error
        full = [point for point in points if isinstance(point, FullPoint)]
        if not full or len(full) != len(points):
            raise InputError("other messages than points", allowed="JOINT_TRAJ_PT_FULL")
        return np.array([point.time for point in full]), np.array([point.positions[: robot.n] for point in full])
