"""Options of logs: how files are read, and what is known of a recording beside them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from oed.cli.declarations.declared import INPUT
from robots.common.options import Option

if TYPE_CHECKING:
    from estimation.logs.mappings.mapping import LogMapping
    from estimation.logs.parquet_streams import LogStream
    from robots.robot import Robot
    from robots.signals import Log

Recorded = TypeVar("Recorded", "Log", "LogStream")


@dataclass(frozen=True, kw_only=True)
class Columns:
    """How the columns of logs are read.

    Attributes:
        mapping: a YAML file with names, units, signs and order of the log's columns.
        rate: rows per second of a log without a column of time. It replaces a column that does not hold the time.
    """

    section = INPUT

    mapping: Path | None = None
    rate: Annotated[float | None, Option(shown="HZ")] = None

    @cached_property
    def stated(self) -> LogMapping | Path | None:
        """What both options state together.

        Raises:
            InputError: a rate that is not positive, or beside a column of time that the mapping names.
        """
        if self.rate is None:
            return self.mapping
        from estimation.logs.mappings.mapping import stated_rate

        return stated_rate(self.rate, self.mapping)

    def read(self, paths: Sequence[Path], robot: Robot, **settings: Any) -> list[Log]:
        """Reads logs of a robot.

        Args:
            paths: files and folders; none for no logs.
            robot: the robot.
            settings: further ones of `estimation.read_logs`.

        Raises:
            InputError: see `estimation.read_logs`.
        """
        if not paths:
            return []
        from estimation import read_logs

        of_robot: dict[str, Any] = {"n": robot.n, "joints": robot.joint_names, "kinds": robot.chain.kinds}
        return list(read_logs(paths, mapping=self.stated, **(of_robot | settings)))


@dataclass(frozen=True, kw_only=True)
class TorqueMeaning(Columns):
    """What the torque columns of logs hold.

    Attributes:
        torque_is: what the torque columns hold, if not joint torques: current, motor, or without-gravity. With joints
            if it concerns some only: motor:2,5.
    """

    torque_is: str | None = None

    def as_joint_torque(
        self, robot: Robot, logs: Sequence[Log], without: Sequence[Log] | None = None
    ) -> tuple[Robot, list[Log]]:
        """Converts torque columns of another meaning to joint torques, by the robot's description.

        Args:
            robot: of the logs.
            logs: with their payloads and gravity vectors; a log without torque stays as it is.
            without: those of the logs that have no unknown payload, by which torque constants are estimated; None for
                all.

        Returns:
            The robot, with estimated torque constants where it needs them, and the logs.

        Raises:
            InputError: an unknown meaning, or a description that lacks what is needed.
        """
        from estimation.regressions.torque_meanings import as_joint_torques

        return as_joint_torques(robot, logs, self.torque_is, without=without)


@dataclass(frozen=True, kw_only=True)
class LoadedLogs(TorqueMeaning):
    """Logs with known payloads.

    Attributes:
        payload: known payload in a log, as NUMBER=KG,X,Y,Z: number of the log, mass [kg], centre of mass in the flange
            frame [m]; or NUMBER=payload.json. Without NUMBER= it applies to all logs. Logs of other options are
            numbered after those of --log.
    """

    payload: Annotated[tuple[str, ...], Option(names_file=True)] = ()

    def with_setup(self, logs: Sequence[Recorded]) -> list[Recorded]:
        """Adds known payloads and gravity vectors to logs.

        Args:
            logs: in the order in which they were read; they are numbered from 1.

        Raises:
            InputError: a text of another form, a number without a log, or a number given twice.
        """
        from estimation.payloads.stated import with_stated_setup

        return with_stated_setup(logs, payloads=self.payload, gravities=getattr(self, "gravity", ()))

    def read_known(self, paths: Sequence[Path], robot: Robot, **settings: Any) -> tuple[Robot, list[Log]]:
        """Reads logs with all that is known of their setup, as joint torques.

        Args:
            paths: files and folders.
            robot: the robot.
            settings: further ones of `estimation.read_logs`.

        Returns:
            The robot, with estimated torque constants where it needs them, and the logs.

        Raises:
            InputError: see `read`, `with_setup` and `as_joint_torque`.
        """
        return self.as_joint_torque(robot, self.with_setup(self.read(paths, robot, **settings)))


@dataclass(frozen=True, kw_only=True)
class KnownLogs(LoadedLogs):
    """Logs with known payloads and base orientations.

    Attributes:
        gravity: gravity in the base frame for a log with a tilted base, as NUMBER=X,Y,Z: number of the log, gravity
            [m/s2]. Without NUMBER= it applies to all logs.
    """

    gravity: tuple[str, ...] = ()
