"""Recordings of KUKA's fast robot interface (FRI): ``collect_data`` of pyfri, and tables with the interface's names."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import ClassVar

from estimation.logs.mappings.mapping import Clock, LogMapping, PerJoint
from estimation.logs.recorders.recorder import Recognised, Recorder, missing, numbered, span
from estimation.logs.torque_source import TorqueSource
from robots.common.tables.table import Table

# Spellings of a quantity, without case and separators: pyfri, the C++ interface, its ROS messages, and drake's.
_POSITIONS = ("mp", "measuredjointposition", "measuredjointpositions", "jointpositionmeasured", "msrjntpos")
_TORQUES = (
    *("mt", "measuredtorque", "measuredtorques", "measuredjointtorque", "measuredjointtorques"),
    *("jointtorquemeasured", "msrjnttrq"),
)
_TIMES = {"time": "s", "timestamp": "s", "t": "s", "utime": "us", "timestampsec": "s"}
_NUMBERED = re.compile(r"(.*?[A-Za-z])([\[_. ]*)(\d+)(\]?)")
JOINTS = 7


class KukaFri(Recorder):
    """Measured joint positions [rad] and torques [N m] of an LBR robot."""

    name: ClassVar[str] = "KUKA FRI recording"
    wanted: ClassVar[re.Pattern[str]] = re.compile(
        r"(?i)u?time|t|time_?stamp(_?sec)?|m[pt]\d+|.*(measured|msr).*\d+\]?"
    )

    def recognises(self, names: Sequence[str]) -> bool:
        """Whether measured positions and torques of the interface are there; two letters need a third column."""
        position, torque = _pattern(names, _POSITIONS), _pattern(names, _TORQUES)
        if position is None or torque is None:
            return False
        return position[0] != "mp{}" or bool({"ip1", "et1", "tsec"} & set(names))

    def understood(self, table: Table, joints: Sequence[str] | None) -> Recognised:
        """Takes the measured columns."""
        position, torque = _pattern(table.names, _POSITIONS), _pattern(table.names, _TORQUES)
        assert position is not None
        assert torque is not None
        q = numbered(table, *position, JOINTS)
        tau = numbered(table, *torque, JOINTS)
        time = next((name for key in _TIMES for name in table.names if _plain(name) == key), None)
        if time is None:
            raise missing(table, "time", "write the time of each state, too")
        source = TorqueSource(
            format=self.name,
            columns=span(tau),
            quantity="torque",
            measured=True,
            meaning="the joint torque sensors, gravity included; some versions state the load's torque, which has "
            "the other sign",
        )
        mapping = LogMapping(
            time=Clock(column=time, unit=_TIMES[_plain(time)]),
            position=PerJoint(columns=q),
            torque=PerJoint(columns=tau),
        )
        return Recognised(mapping=mapping, joints=len(q), source=source, remedy="write the measured torque, too")


def _pattern(names: Sequence[str], spellings: Sequence[str]) -> tuple[str, int] | None:
    """Finds the pattern of a quantity's columns, and the number of the first joint."""
    for name in names:
        match = _NUMBERED.fullmatch(name)
        if match is not None and int(match[3]) <= 1 and _plain(match[1]) in spellings:
            stem, before, number, after = match.groups()
            if number == "1" and f"{stem}{before}0{after}" in names:
                continue
            return f"{stem}{before}{{}}{after}", int(number)
    return None


def _plain(name: str) -> str:
    return re.sub(r"[^a-z]", "", name.lower())
