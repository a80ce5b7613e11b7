"""Recordings of UR's real-time data exchange (RTDE): ``record.py`` of UR's client library, and of ``ur_rtde``."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import ClassVar

from estimation.logs.mappings.mapping import Clock, LogMapping
from estimation.logs.recorders.recorder import Recognised, Recorder, first_of, missing, span
from estimation.logs.torque_source import TorqueSource
from robots.common.tables.table import Table

# Measured before commanded: quantity, whether measured, meaning.
_TORQUES = {
    "actual_current_as_torque_{}": ("torque", True, "measured motor currents that the controller gives as torques"),
    "actual_current_{}": ("current", True, "measured motor currents [A]"),
    "target_moment_{}": (
        "torque",
        False,
        "torques that the controller computes from its own model; they contain nothing that this model lacks",
    ),
    "target_current_{}": ("current", False, "commanded motor currents [A]"),
}


class UrRtde(Recorder):
    """One row a message, names as in the RTDE guide, and the joint from 0: base, shoulder, elbow, three wrists."""

    name: ClassVar[str] = "UR RTDE recording"
    wanted: ClassVar[re.Pattern[str]] = re.compile(
        r"timestamp|(actual|target)_(q|qd|current|moment)_\d+|actual_current_as_torque_\d+|joint_temperatures_\d+"
    )

    def recognises(self, names: Sequence[str]) -> bool:
        """Whether the columns have RTDE's names of joint positions."""
        present = set(names)
        return "actual_q_0" in present or {"target_q_0", "timestamp"} <= present

    def understood(self, table: Table, joints: Sequence[str] | None) -> Recognised:
        """Takes measured columns before commanded ones."""
        position, q = first_of(table, ("actual_q_{}", "target_q_{}"))
        count = len(q.columns)
        if "timestamp" not in table.columns:
            raise missing(table, "timestamp", "record `timestamp`, too: without it the rows have no time")
        _, dq = first_of(table, (position.replace("_q_", "_qd_"),), count=count)
        _, temperatures = first_of(table, ("joint_temperatures_{}",), count=count)
        chosen, torque = first_of(table, tuple(_TORQUES), count=count)
        source = None
        if chosen:
            quantity, measured, meaning = _TORQUES[chosen]
            commanded = chosen != "target_moment_{}" and "target_moment_0" in table.columns
            source = TorqueSource(
                format=self.name,
                columns=span(torque.columns),
                quantity="current" if quantity == "current" else "torque",
                measured=measured,
                meaning=meaning,
                instead=_instead(commanded) if quantity == "current" else None,
            )
        current = source is not None and source.quantity == "current"
        mapping = LogMapping(
            time=Clock(column="timestamp", unit="s"),
            position=q,
            velocity=dq if dq.columns else None,
            torque=torque if torque.columns and not current else None,
            current=torque if current else None,
            temperature=temperatures if temperatures.columns else None,
        )
        return Recognised(
            mapping=mapping,
            joints=count,
            source=source,
            remedy="record `actual_current`, or `actual_current_as_torque` where the controller has it",
        )


def _instead(commanded: bool) -> str:
    constants = "state `torque_constant: [...]` [N m/A], one a joint, in a mapping (--mapping)"
    if not commanded:
        return constants
    return f'{constants}, or take the commanded torques there with `torque: {{columns: "target_moment_{{index}}"}}`'
