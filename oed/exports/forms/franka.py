"""Franka: a CSV of joint positions and velocities at 1 kHz, and a program for libfranka that plays it and logs."""

from __future__ import annotations

from importlib.resources import files
from typing import ClassVar

import numpy as np

from oed.exports.forms.base import Array, ExportOptions, Form, number, require_joints
from robots.common.errors import InputError
from robots.robot import Robot
from robots.signals import Motion


class Franka(Form):
    """Rows of time, seven positions and seven velocities below one header line."""

    name: ClassVar[str] = "franka"
    suffixes: ClassVar[tuple[str, ...]] = (".csv",)
    period: ClassVar[float | None] = 0.001

    def write(self, motion: Motion, robot: Robot, options: ExportOptions, suffix: str) -> bytes:
        """See `Form.write`."""
        require_joints(robot, 7, 7, "a Franka arm")
        names = ["time", *(f"{prefix}{joint}" for prefix in ("q", "dq") for joint in range(1, 8))]
        rows = np.column_stack([motion.t, motion.q, motion.dq]).tolist()
        return "\n".join([",".join(names), *(",".join(map(repr, row)) for row in rows), ""]).encode()

    def read(self, content: bytes, robot: Robot, suffix: str) -> tuple[Array, Array]:
        """See `Form.read`."""
        lines = content.decode("utf-8", errors="replace").split("\n")
        try:
            rows = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:] if line])
            return rows[:, 0], rows[:, 1 : 1 + robot.n]
        except (ValueError, IndexError) as error:
            raise InputError(f"no rows of numbers ({error})", allowed="a file of this form") from error


class FrankaPlayer(Form):
    """The source of a C++ program that plays any such CSV on an arm, and logs what the arm does."""

    name: ClassVar[str] = "franka-player"
    suffixes: ClassVar[tuple[str, ...]] = (".cpp",)
    has_samples: ClassVar[bool] = False

    def write(self, motion: Motion, robot: Robot, options: ExportOptions, suffix: str) -> bytes:
        """See `Form.write`."""
        require_joints(robot, 7, 7, "a Franka arm")
        source = (files("oed.exports.forms.programs") / "franka_player.cpp").read_text("utf-8")
        return source.replace("@START_TOLERANCE@", number(options.start_tolerance)).encode()
