"""ABB: a RAPID module with an array of joint targets in degrees."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from oed.exports.forms.base import Array, ExportOptions, Form, number, require_joints
from robots.common.errors import InputError
from robots.robot import Robot
from robots.signals import Motion

AXES = 6
_TARGET = re.compile(r"^ +\[\[([^]]*)\],\[9E9", re.MULTILINE)
_PERIOD = re.compile(r"CONST num period:=([\d.]+);")


class Abb(Form):
    """A .mod file with the points, for a program that moves from point to point at a fixed period."""

    name: ClassVar[str] = "abb"
    suffixes: ClassVar[tuple[str, ...]] = (".mod",)
    comment: ClassVar[Mapping[str, str]] = {".mod": "!"}

    def write(self, motion: Motion, robot: Robot, options: ExportOptions, suffix: str) -> bytes:
        """See `Form.write`."""
        require_joints(robot, 1, AXES, "jointtarget")
        external = ",".join(["9E9"] * 6)
        targets = []
        for row in np.rad2deg(motion.q).tolist():
            axes = ",".join(number(value, 7) for value in row + [0.0] * (AXES - robot.n))
            targets.append(f"    [[{axes}],[{external}]]")
        lines = [
            f"MODULE {options.name}",
            f"  CONST num period:={number(motion.period or 0.0)};",
            f"  CONST num count:={len(motion)};",
            f"  CONST jointtarget points{{{len(motion)}}}:=[",
            ",\n".join(targets),
            "  ];",
            "ENDMODULE",
            "",
        ]
        return "\n".join(lines).encode()

    def read(self, content: bytes, robot: Robot, suffix: str) -> tuple[Array, Array]:
        """See `Form.read`."""
        text = content.decode("utf-8", errors="replace")
        period, rows = _PERIOD.search(text), _TARGET.findall(text)
        if period is None or not rows:
            raise InputError("no joint targets", allowed="a module of this form")
        q = np.array([[float(value) for value in row.split(",")][: robot.n] for row in rows])
        return float(period[1]) * np.arange(len(q), dtype=np.float64), np.deg2rad(q)
