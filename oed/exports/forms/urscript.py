"""URScript: servoj at the controller's period, behind a guard on the start position."""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from oed.exports.forms.base import Array, ExportOptions, Form, number, require_joints
from robots.common.errors import AssumedValueWarning, InputError
from robots.robot import Robot
from robots.signals import Motion

CYCLES = {0.008: "CB", 0.002: "e-series"}
"""Cycle of the controllers [s]: a servoj takes at least one, so shorter ones play the motion too slowly."""

SERVO_LOOKAHEAD, SERVO_GAIN = 0.1, 300
SERVO_SETTLING = 0.4
"""How long the last point is held, so that the robot reaches it [s]: servoj follows 0.1 s later or more."""

MOST_PROGRAM_POINTS = 1000
"""Points of a program that all controllers have taken.

The maker states no limit. Users report that programs end without a word beyond 1,000 to 2,500 moves.
"""

_POINT = re.compile(r"^  servoj\(\[([^]]*)\], 0, 0, ([\d.]+)", re.MULTILINE)


class UrScript(Form):
    """A program for Universal Robots at the period of the robot: 8 ms of CB controllers, 2 ms of the e-series."""

    name: ClassVar[str] = "urscript"
    suffixes: ClassVar[tuple[str, ...]] = (".script",)
    comment: ClassVar[Mapping[str, str]] = {".script": "#"}
    period: ClassVar[float | None] = 0.002

    def period_of(self, robot: Robot) -> float | None:
        """See `Form.period_of`; a robot with another period than a UR controller's gets that of the e-series."""
        found = next((cycle for cycle in CYCLES if abs(cycle - robot.period) < 1e-6), None)
        if found is None:
            text = (
                f"{robot.name} has a period of {1e3 * robot.period:g} ms, which is none of a UR controller: 2 ms of "
                "the e-series are taken. CB controllers need --period 0.008"
            )
            warnings.warn(AssumedValueWarning(text), stacklevel=4)
        return found or self.period

    def write(self, motion: Motion, robot: Robot, options: ExportOptions, suffix: str) -> bytes:
        """See `Form.write`."""
        require_joints(robot, 6, 6, "a UR controller")
        period = motion.period or 0.0
        if robot.period in CYCLES and period < robot.period - 1e-6:
            text = (
                f"commands of {1e3 * period:g} ms are shorter than the cycle of {robot.name}'s controller "
                f"({CYCLES[robot.period]}, {1e3 * robot.period:g} ms): it plays the motion too slowly. Leave out "
                "--period, or state the period of another controller in the robot's description"
            )
            warnings.warn(AssumedValueWarning(text), stacklevel=4)
        if len(motion) > MOST_PROGRAM_POINTS:
            text = (
                f"a program of {len(motion)} points: controllers have refused programs of more than "
                f"{MOST_PROGRAM_POINTS} to 2,500 moves. If yours does, use `oed stream --driver ur`, which has no "
                "limit, or a longer --period"
            )
            warnings.warn(AssumedValueWarning(text), stacklevel=4)
        # The two zeros are an acceleration and a speed that the command does not use.
        tail = f"0, 0, {number(period)}, {number(SERVO_LOOKAHEAD)}, {SERVO_GAIN})"
        lines = [
            f"def {options.name}():",
            *start_check(motion.q[0], options.start_tolerance),
            *(f"  servoj({_list(row)}, {tail}" for row in motion.q),
            # The robot follows later: the end is held until it is there.
            "  waited = 0",
            f"  while waited < {int(np.ceil(SERVO_SETTLING / period))}:",
            f"    servoj({_list(motion.q[-1])}, {tail}",
            "    waited = waited + 1",
            "  end",
            "  stopj(2.0)",
            "end",
            "",
        ]
        return "\n".join(lines).encode()

    def read(self, content: bytes, robot: Robot, suffix: str) -> tuple[Array, Array]:
        """See `Form.read`."""
        found = _POINT.findall(content.decode("utf-8", errors="replace"))
        if not found:
            raise InputError("no servoj commands", allowed="a program of this form")
        q = np.array([[float(value) for value in row.split(",")] for row, _ in found])
        return float(found[0][1]) * np.arange(len(q), dtype=np.float64), q


def start_check(pose: Array, tolerance: float) -> list[str]:
    """Gives the lines of a program that end it if the robot stands elsewhere.

    Args:
        pose: where it has to stand (6,) [rad].
        tolerance: farthest distance of a joint [rad].
    """
    return [
        f"  start = {_list(pose)}",
        "  actual = get_actual_joint_positions()",
        "  joint = 0",
        "  while joint < 6:",
        f"    if norm(actual[joint] - start[joint]) > {number(tolerance)}:",
        '      popup("The robot is not at the start of the trajectory.", error=True, blocking=True)',
        "      halt",
        "    end",
        "    joint = joint + 1",
        "  end",
    ]


def _list(row: Array) -> str:
    return "[" + ", ".join(number(float(value)) for value in row) + "]"
