"""The logs of one robot, checked, repaired and cut at their gaps, once for every question."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property

from estimation.gate import GateReport, check_logs
from estimation.regressions.preparation import Prepared, prepare_all
from estimation.regressions.torque_meanings import as_joint_torque, with_torque_constants
from robots.common.errors import InputError
from robots.robot import Robot
from robots.signals import Log


@dataclass(frozen=True, eq=False)
class Recording:
    """Logs of one robot, made ready for a fit.

    Attributes:
        robot: with the torque constants that the logs show, where its description states none.
        logs: as they were recorded, in joint torques.
        gates: what the gate found in each log; empty where it was not asked.
        parts: what is used of each log: the rows between its gaps, without outliers and copies. Empty for a log that
            is left out.
    """

    robot: Robot
    logs: tuple[Log, ...]
    gates: tuple[GateReport, ...]
    parts: tuple[tuple[Log, ...], ...]

    @property
    def used(self) -> list[Log]:
        """The logs with rows that are used."""
        return [log for log, own in zip(self.logs, self.parts, strict=True) if own]

    def repaired(self, shortest: float) -> list[tuple[Log, ...]]:
        """Gives each used log's rows between its gaps, with interpolated outliers, so that rows stay evenly spaced.

        Args:
            shortest: duration [s] of the shortest part that is of use beside longer ones.
        """
        if not self.gates:
            return [(log,) for log in self.logs]
        found = []
        for gate, log, own in zip(self.gates, self.logs, self.parts, strict=True):
            if own:
                longest = max(float(gate.t[stop - 1] - gate.t[first]) for first, stop in gate.parts)
                found.append(gate.usable(log, interpolate=("q", "tau", "current"), shortest=min(shortest, longest)))
        return found

    @cached_property
    def prepared(self) -> list[Prepared]:
        """The parts of all logs in turn, with their torque, and their positions on a grid."""
        return prepare_all(self.robot, [part for own in self.parts for part in own])


def make_ready(
    robot: Robot,
    logs: Log | Sequence[Log],
    *,
    check: bool = True,
    tolerated: Collection[str] = (),
) -> Recording:
    """Converts logs to joint torques, checks them, and takes what can be fitted.

    Args:
        robot: the robot.
        logs: one or several; one that states another meaning of its torques is converted.
        check: whether each log passes the gate, which refuses what would be fitted wrongly, cuts at gaps, and leaves
            out logs that rest beside others that move.
        tolerated: names of the gate's findings that refuse no log.

    Raises:
        InputError: no logs, logs of another robot, or one that the gate refuses.
        NotIdentifiableError: a log whose motion determines nothing.
    """
    given = [logs] if isinstance(logs, Log) else list(logs)
    if not given:
        raise InputError("no logs", allowed="one or more")
    robot = with_torque_constants(robot, given)
    joint_torques = tuple(as_joint_torque(robot, log, estimate=False) for log in given)
    if not check:
        return Recording(robot, joint_torques, (), tuple((log,) for log in joint_torques))
    gates = check_logs(robot, joint_torques, tolerated)
    parts = tuple(gate.usable(log) for gate, log in zip(gates, joint_torques, strict=True))
    return Recording(robot, joint_torques, gates, parts)
