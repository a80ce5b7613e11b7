"""KUKA: a KRL program that moves through a timed spline, or a data list of axis positions in degrees."""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from oed.exports.forms.base import Array, ExportOptions, Form, number, require_joints
from oed.exports.forms.controller_programs import (
    axes_in_degrees,
    pieces,
    require_name,
    reserved_words,
    spline_points,
)
from robots.common.errors import InputError
from robots.joints.controller_axes import joints_of
from robots.robot import Robot
from robots.signals import Motion

KRL_START_PERCENT = 10
"""Speed and acceleration of the move to the start [%]."""

RESERVED = reserved_words("krl_words.txt")
"""Words of the language, and names in the program."""

_LISTED = re.compile(r"^POINT(?:_\d+)?\[\d+\]=\{(.*)\}$", re.MULTILINE)
_START = re.compile(r"^START=\{(.*)\}$", re.MULTILINE)
_PERIOD = re.compile(r"^DECL REAL PERIOD=([\d.]+)$", re.MULTILINE)
_STEPS = re.compile(r"^  SPTP \{(.*)\}$|^WAIT SEC ([\d.]+)$|^  TIME_BLOCK END=([\d.]+)$", re.MULTILINE)


class Kuka(Form):
    """A .src file: a start check, a slow PTP to the start, then PTP splines whose points have their times.

    Between two splines the robot rests.

    A .dat file is a list of all samples, an array of E6AXIS, for a program of one's own.
    """

    name: ClassVar[str] = "kuka"
    suffixes: ClassVar[tuple[str, ...]] = (".src", ".dat")
    comment: ClassVar[Mapping[str, str]] = {".src": ";", ".dat": ";"}
    named: ClassVar[bool] = True

    def write(self, motion: Motion, robot: Robot, options: ExportOptions, suffix: str) -> bytes:
        """See `Form.write`."""
        require_joints(robot, 1, 6, "E6AXIS")
        # Characters of a name, at most.
        require_name(options.name, 24, RESERVED, "KRL")
        lines = _program(motion, robot, options) if suffix == ".src" else _data_list(motion, robot, options)
        return "\n".join([*lines, ""]).encode()

    def read(self, content: bytes, robot: Robot, suffix: str) -> tuple[Array, Array]:
        """See `Form.read`; of a program the points of its spline."""
        text = content.decode("utf-8", errors="replace")
        if suffix == ".src":
            return _read_program(text, robot)
        period, rows = _PERIOD.search(text), _LISTED.findall(text)
        if period is None or not rows:
            raise InputError("no list of points", allowed="a data list of this form")
        q = _positions(rows, robot)
        return float(period[1]) * np.arange(len(q), dtype=np.float64), q


def _read_program(text: str, robot: Robot) -> tuple[Array, Array]:
    start, steps = _START.search(text), _STEPS.findall(text)
    ends = [k for k, step in enumerate(steps) if step[2]]
    first = sum(bool(step[0]) for step in steps[: ends[0]]) if ends else 0
    period = float(steps[ends[0]][2]) / first if first else 0.0
    if start is None or not period > 0:
        raise InputError("no timed spline", allowed="a program of this form")
    rows = [start[1]]
    for point, pause, _ in steps:
        rows += [point] if point else [rows[-1]] * round(float(pause or 0.0) / period)
    q = _positions(rows, robot)
    return period * np.arange(len(q), dtype=np.float64), q


def _program(motion: Motion, robot: Robot, options: ExportOptions) -> list[str]:
    points, error = spline_points(motion)
    axes = axes_in_degrees(points.q, robot)
    farthest = [f"ABS($AXIS_ACT.A{joint}-START.A{joint})" for joint in range(1, robot.n + 1)]
    check = [f"FAR={farthest[0]}"]
    for distance in farthest[1:]:
        check += [f"IF {distance}>FAR THEN", f"  FAR={distance}", "ENDIF"]
    return [
        f"DEF {options.name}( )",
        f"; {len(points)} points; a cubic spline through them is within {np.rad2deg(error):.2g} deg of the trajectory",
        "; The time that the controller needs may be longer: log what it does",
        "DECL E6AXIS START",
        "DECL REAL FAR",
        "GLOBAL INTERRUPT DECL 3 WHEN $STOPMESS==TRUE DO IR_STOPM( )",
        "INTERRUPT ON 3",
        "BAS(#INITMOV,0)",
        f"START={_aggregate(axes[0])}",
        "WAIT SEC 0",
        *check,
        f"IF FAR>{number(float(np.rad2deg(options.start_tolerance)), 4)} THEN",
        "  ; The robot is not at the start: a continued program moves it there, slowly and straight",
        "  HALT",
        "ENDIF",
        f"BAS(#VEL_PTP,{KRL_START_PERCENT})",
        f"BAS(#ACC_PTP,{KRL_START_PERCENT})",
        "PTP START",
        "BAS(#VEL_PTP,100)",
        "BAS(#ACC_PTP,100)",
        *_moves(axes, points.period or 0.0),
        "END",
    ]


def _moves(axes: Array, period: float) -> list[str]:
    """Gives a spline for each stretch in which the robot moves, and a wait for each rest."""
    # Points that differ by less are a rest [deg]: a spline has no piece without length.
    stands = np.abs(np.diff(axes, axis=0)).max(axis=1) < 1e-6
    edges = [0, *(np.flatnonzero(np.diff(stands)) + 1).tolist(), len(stands)]
    lines = []
    for first, last in itertools.pairwise(edges):
        time = number((last - first) * period)
        if stands[first]:
            lines.append(f"WAIT SEC {time}")
            continue
        lines += ["PTP_SPLINE", "  TIME_BLOCK START"]
        for row in axes[first + 1 : last + 1]:
            lines += [f"  SPTP {_aggregate(row)}", "  TIME_BLOCK PART=1"]
        lines += [f"  TIME_BLOCK END={time}", "ENDSPLINE"]
    return lines


def _data_list(motion: Motion, robot: Robot, options: ExportOptions) -> list[str]:
    axes, parts = axes_in_degrees(motion.q, robot), pieces(len(motion))
    names = ["POINT", *(f"POINT_{number}" for number in range(2, len(parts) + 1))]
    lines = [
        f"DEFDAT {options.name} PUBLIC",
        f"DECL INT COUNT={len(motion)}",
        f"DECL REAL PERIOD={number(motion.period or 0.0)}",
    ]
    for name, part in zip(names, parts, strict=True):
        lines.append(f"DECL E6AXIS {name}[{part.stop - part.start}]")
        lines += [f"{name}[{k}]={_aggregate(row)}" for k, row in enumerate(axes[part], start=1)]
    return [*lines, "ENDDAT"]


def _aggregate(row: Array) -> str:
    return "{" + ",".join(f"A{axis} {number(value, 7)}" for axis, value in enumerate(row.tolist(), start=1)) + "}"


def _positions(rows: list[str], robot: Robot) -> Array:
    return joints_of(robot.axes, [[float(axis.split()[1]) for axis in row.split(",")] for row in rows])
