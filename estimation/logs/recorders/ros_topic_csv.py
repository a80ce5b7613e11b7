"""Tables of ROS joint states, as ``rostopic echo -p`` prints them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import ClassVar

from estimation.logs.mappings.mapping import Clock, LogMapping, PerJoint
from estimation.logs.readers.joint_names import places
from estimation.logs.recorders.recorder import Recognised, Recorder, numbered, span
from estimation.logs.torque_source import TorqueSource
from robots.common.errors import InputError
from robots.common.tables.table import Table


def _number(column: str) -> int:
    return int(re.sub(r"\D", "", column))


class RosTopicCsv(Recorder):
    """One row a message of ``sensor_msgs/JointState``: ``field.name0``, ``field.position0`` and so on."""

    name: ClassVar[str] = "rostopic table"
    wanted: ClassVar[re.Pattern[str]] = re.compile(r"%time|field\.(header\.stamp|(name|position|velocity|effort)\d+)")

    def recognises(self, names: Sequence[str]) -> bool:
        """Whether the columns have the names of joint states in a printed topic."""
        return {"%time", "field.name0", "field.position0"} <= set(names)

    def understood(self, table: Table, joints: Sequence[str] | None) -> Recognised:
        """Puts the joints into the robot's order by their names, which each row states."""
        found = [self._name(table, column) for column in numbered(table, "field.name{}")]
        order = list(range(len(found))) if joints is None else places(found, joints)
        if order is None:
            raise InputError(
                f"no columns of the joints {', '.join(joints or ())}",
                file=table.path,
                column="field.name0",
                allowed=f"names in the table: {', '.join(found)}",
                remedy="choose the robot of this log, or name its joints in order in a mapping (--mapping), "
                f"such as joints: [{', '.join(found)}]",
            )
        columns = {
            key: numbered(table, f"field.{key}{{}}", 0, len(found)) for key in ("position", "velocity", "effort")
        }
        columns = {key: [names[place] for place in order] if names else [] for key, names in columns.items()}
        stamp = "field.header.stamp" if "field.header.stamp" in table.columns else "%time"
        effort = columns["effort"]
        source = TorqueSource(
            format=self.name,
            columns=span(sorted(effort, key=_number)) if effort else "",
            quantity="effort",
            measured=True,
            meaning="the effort that the robot's driver publishes",
        )
        return Recognised(
            mapping=LogMapping(
                time=Clock(column=stamp, unit="ns"),
                position=PerJoint(columns=columns["position"]),
                velocity=PerJoint(columns=columns["velocity"]) if columns["velocity"] else None,
                torque=PerJoint(columns=effort) if effort else None,
            ),
            joints=len(order),
            source=source if effort else None,
            remedy="publish the effort of the joints",
        )

    @staticmethod
    def _name(table: Table, column: str) -> str:
        values = table.columns[column]
        other = next((row for row, value in enumerate(values) if value != values[0]), None)
        if other is not None:
            raise InputError(
                f"{values[other]!r} after {values[0]!r}: messages of several sources",
                file=table.path,
                column=column,
                row=table.line(other),
                remedy="record one topic with the joints of one robot",
            )
        return str(values[0])
