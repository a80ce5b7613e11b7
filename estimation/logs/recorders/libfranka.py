"""Recordings of libfranka: its ``logToCSV``, and tables of a robot state's fields."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from estimation.logs.mappings.mapping import Clock, LogMapping
from estimation.logs.recorders.recorder import Recognised, Recorder, first_of, missing, numbered, span
from estimation.logs.torque_source import TorqueSource
from robots.common.tables.table import Table

_TORQUE = re.compile(r"((?:.*[./])?)tau_J([\[_.]?)([01])(\]?)")
_TIMES = ("duration", "time", "time_ms", "timestamp", "t")
JOINTS = 7


class LibFranka(Recorder):
    """Fields of ``franka::RobotState``, with the joint in brackets from 0; time in ms since the robot's start."""

    name: ClassVar[str] = "libfranka recording"
    wanted: ClassVar[re.Pattern[str]] = re.compile(
        r"duration|time|time_ms|timestamp|t|(.*[./])?(q|dq|tau_J|tau_J_d)[\[_.]?\d+\]?"
    )

    def recognises(self, names: Sequence[str]) -> bool:
        """Whether the columns have libfranka's name of the measured torques, and positions beside them."""
        form = _form(names)
        return form is not None and form[0].format("q") in names

    def understood(self, table: Table, joints: Sequence[str] | None) -> Recognised:
        """Takes the measured state; commands have names of their own."""
        form = _form(table.names)
        assert form is not None
        _, pattern, first = form
        q, dq, tau = (numbered(table, pattern.replace("@", name), first, JOINTS) for name in ("q", "dq", "tau_J"))
        time = next((name for name in _TIMES if name in table.columns), None)
        if time is None:
            raise missing(table, "time", "write the time of the robot state, too")
        source = TorqueSource(
            format=self.name,
            columns=span(tau),
            quantity="torque",
            measured=True,
            meaning="the link-side joint torque sensors, gravity included",
        )
        mapping = LogMapping(
            time=Clock(column=time, unit=_unit(table, time)),
            position=first_of(table, (pattern.replace("@", "q"),), first, JOINTS)[1],
            velocity=first_of(table, (pattern.replace("@", "dq"),), first, JOINTS)[1] if dq else None,
            torque=first_of(table, (pattern.replace("@", "tau_J"),), first, JOINTS)[1],
        )
        return Recognised(mapping=mapping, joints=len(q), source=source, remedy="write tau_J, too")


def _form(names: Sequence[str]) -> tuple[str, str, int] | None:
    """Finds how the first joint of a field is written, all joints (with @ for the field), and the first number."""
    for name in names:
        match = _TORQUE.fullmatch(name)
        if match is None or (match[2] == "[") != (match[4] == "]"):
            continue
        before, opened, number, closed = match.groups()
        if number == "1" and f"{before}tau_J{opened}0{closed}" in names:
            continue
        return f"{before}{{}}{opened}{number}{closed}", f"{before}@{opened}{{}}{closed}", int(number)
    return None


def _unit(table: Table, time: str) -> str:
    """Finds the unit of time: a Franka robot has a cycle of 1 ms, so that steps in ms are whole numbers."""
    if time in ("duration", "time_ms") or table.is_text(time):
        return "s" if table.is_text(time) else "ms"
    steps = np.diff(table.columns[time])
    return "ms" if len(steps) and np.median(steps) >= 0.5 else "s"
