"""ABB: a RAPID module that moves through joint targets in degrees, each with its time."""

from __future__ import annotations

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

RAPID_AXES = 6

PLAY = "_play"
"""What follows the module's name in that of its procedure."""

DEVICE = "OED"
"""Name of the device of transmission (UDPUC) that the controller has to have for EGM."""

RAPID_NEAR = 0.1
"""A guided axis has arrived within this [deg]."""

EGM_STANDING_TIME = 60
"""The guided motion ends once the robot has stood for so long [s]; pauses of a trajectory must be shorter."""

EGM_TIMEOUT = 60
"""The guided motion ends without messages for so long [s]; it waits so long for `oed stream`, too."""

RAPID_NAME_LENGTH = 32
"""Characters of a name, at most."""

RESERVED = reserved_words("rapid_words.txt")
"""Words of the language, and names that a controller has already."""

_TARGET = re.compile(r"^ +\[\[([^]]*)\],\[9E9", re.MULTILINE)
_PERIOD = re.compile(r"CONST num period:=([\d.]+);")


class Abb(Form):
    """A .mod file: a start check, a slow MoveAbsJ to the start, then one MoveAbsJ a point with its time.

    The targets are far enough from each other for the motion planner, whose corners are rounded: the module plays the
    path, not each sample.
    """

    name: ClassVar[str] = "abb"
    suffixes: ClassVar[tuple[str, ...]] = (".mod",)
    comment: ClassVar[Mapping[str, str]] = {".mod": "!"}
    named: ClassVar[bool] = True

    def write(self, motion: Motion, robot: Robot, options: ExportOptions, suffix: str) -> bytes:
        """See `Form.write`."""
        require_joints(robot, 1, RAPID_AXES, "jointtarget")
        require_name(options.name, RAPID_NAME_LENGTH - len(PLAY), RESERVED, "RAPID")
        points, _ = spline_points(motion)
        axes = np.pad(axes_in_degrees(points.q, robot), ((0, 0), (0, RAPID_AXES - robot.n)))
        external = ",".join(["9E9"] * 6)
        parts = pieces(len(points))
        names = ["points", *(f"points_{number}" for number in range(2, len(parts) + 1))]
        lines = [
            f"MODULE {options.name}",
            f"  CONST num period:={number(points.period or 0.0)};",
            f"  CONST num count:={len(points)};",
        ]
        for name, part in zip(names, parts, strict=True):
            rows = [
                f"    [[{','.join(number(value, 7) for value in row)}],[{external}]]" for row in axes[part].tolist()
            ]
            lines += [f"  CONST jointtarget {name}{{{len(rows)}}}:=[", ",\n".join(rows), "  ];"]
        lines += [f"  PROC {options.name}{PLAY}()", *_start(robot.n, options)]
        for name, part in zip(names, parts, strict=True):
            first, last = 2 if part.start == 0 else 1, part.stop - part.start
            end = part.stop == len(points)
            lines += [
                f"    FOR i FROM {first} TO {last - int(end)} DO",
                f"      MoveAbsJ {name}{{i}}\\NoEOffs,vmax\\T:=period,z50,tool0;",
                "    ENDFOR",
            ]
            if end:
                lines.append(f"    MoveAbsJ {name}{{{last}}}\\NoEOffs,vmax\\T:=period,fine,tool0;")
        return "\n".join([*lines, "  ENDPROC", "ENDMODULE", ""]).encode()

    def read(self, content: bytes, robot: Robot, suffix: str) -> tuple[Array, Array]:
        """See `Form.read`."""
        text = content.decode("utf-8", errors="replace")
        period, rows = _PERIOD.search(text), _TARGET.findall(text)
        if period is None or not rows:
            raise InputError("no joint targets", allowed="a module of this form")
        axes = np.array([[float(value) for value in row.split(",")][: robot.n] for row in rows])
        return float(period[1]) * np.arange(len(axes), dtype=np.float64), joints_of(robot.axes, axes)


class AbbEgm(Form):
    """A .mod file for `oed stream --driver egm`: a start check, a slow MoveAbsJ to the start, then guided motion.

    The samples come by UDP while it runs. It ends some seconds after the robot stands, or without messages.
    """

    name: ClassVar[str] = "abb-egm"
    suffixes: ClassVar[tuple[str, ...]] = (".mod",)
    comment: ClassVar[Mapping[str, str]] = {".mod": "!"}
    named: ClassVar[bool] = True
    program: ClassVar[str] = "trajectory_egm"
    has_samples: ClassVar[bool] = False

    def write(self, motion: Motion, robot: Robot, options: ExportOptions, suffix: str) -> bytes:
        """See `Form.write`."""
        require_joints(robot, 1, RAPID_AXES, "jointtarget")
        require_name(options.name, RAPID_NAME_LENGTH - len(PLAY), RESERVED, "RAPID")
        start = np.pad(axes_in_degrees(motion.q[:1], robot), ((0, 0), (0, RAPID_AXES - robot.n)))[0].tolist()
        joints, external = range(1, RAPID_AXES + 1), ",".join(["9E9"] * 6)
        within, run = ("".join(f"\\J{joint}{end}" for joint in joints) for end in (":=near", ""))
        lines = [
            f"MODULE {options.name}",
            "  VAR egmident guided;",
            f"  CONST egm_minmax near:=[-{RAPID_NEAR},{RAPID_NEAR}];",
            "  CONST jointtarget points{1}:=[",
            f"    [[{','.join(number(value, 7) for value in start)}],[{external}]]",
            "  ];",
            f"  PROC {options.name}{PLAY}()",
            *_start(robot.n, options),
            "    EGMReset guided;",
            "    EGMGetId guided;",
            f'    EGMSetupUC ROB_1,guided,"default","{DEVICE}"\\Joint\\CommTimeout:={EGM_TIMEOUT};',
            f"    EGMActJoint guided\\Tool:=tool0{within}\\LpFilter:=0\\SampleRate:=4\\MaxSpeedDeviation:=1000;",
            f"    EGMRunJoint guided,EGM_STOP_HOLD{run}\\CondTime:={EGM_STANDING_TIME}"
            "\\RampInTime:=0.01\\PosCorrGain:=1;",
            "    EGMReset guided;",
            "  ERROR",
            "    IF ERRNO=ERR_UDPUC_COMM THEN",
            "      EGMReset guided;",
            "      TRYNEXT;",
            "    ENDIF",
            "  ENDPROC",
            "ENDMODULE",
            "",
        ]
        return "\n".join(lines).encode()


def _start(n: int, options: ExportOptions) -> list[str]:
    """Gives the lines that check the start, and move there slowly."""
    lines = ["    VAR jointtarget here;", "    VAR num far:=0;", "    here:=CJointT();"]
    for axis in range(1, n + 1):
        distance = f"Abs(here.robax.rax_{axis}-points{{1}}.robax.rax_{axis})"
        lines += [f"    IF {distance}>far THEN", f"      far:={distance};", "    ENDIF"]
    return [
        *lines,
        f"    IF far>{number(float(np.rad2deg(options.start_tolerance)), 4)} THEN",
        '      TPWrite "The robot is not at the start; a continued program moves it there."\\Num:=far;',
        "      Stop;",
        "    ENDIF",
        "    MoveAbsJ points{1}\\NoEOffs,v50,fine,tool0;",
    ]
