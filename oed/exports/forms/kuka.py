"""KUKA: a KRL data list of axis positions in degrees."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from oed.exports.forms.base import Array, ExportOptions, Form, number, require_joints
from robots.common.errors import InputError
from robots.robot import Robot
from robots.signals import Motion

_POINT = re.compile(r"^POINT\[\d+\]=\{(.*)\}$", re.MULTILINE)
_PERIOD = re.compile(r"^DECL REAL PERIOD=([\d.]+)$", re.MULTILINE)


class Kuka(Form):
    """A .dat file with an array of E6AXIS, for a program that moves from point to point at a fixed period."""

    name: ClassVar[str] = "kuka"
    suffixes: ClassVar[tuple[str, ...]] = (".dat",)
    comment: ClassVar[Mapping[str, str]] = {".dat": ";"}

    def write(self, motion: Motion, robot: Robot, options: ExportOptions, suffix: str) -> bytes:
        """See `Form.write`."""
        require_joints(robot, 1, 6, "E6AXIS")
        lines = [
            f"DEFDAT {options.name} PUBLIC",
            f"DECL INT COUNT={len(motion)}",
            f"DECL REAL PERIOD={number(motion.period or 0.0)}",
            f"DECL E6AXIS POINT[{len(motion)}]",
        ]
        for k, row in enumerate(np.rad2deg(motion.q).tolist(), start=1):
            axes = ",".join(f"A{joint} {number(value, 7)}" for joint, value in enumerate(row, start=1))
            lines.append(f"POINT[{k}]={{{axes}}}")
        return "\n".join([*lines, "ENDDAT", ""]).encode()

    def read(self, content: bytes, robot: Robot, suffix: str) -> tuple[Array, Array]:
        """See `Form.read`."""
        text = content.decode("utf-8", errors="replace")
        period, rows = _PERIOD.search(text), _POINT.findall(text)
        if period is None or not rows:
            raise InputError("no list of points", allowed="a data list of this form")
        q = np.array([[float(axis.split()[1]) for axis in row.split(",")] for row in rows])
        return float(period[1]) * np.arange(len(q), dtype=np.float64), np.deg2rad(q)
