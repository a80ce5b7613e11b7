"""Options of logs: how files are read, and what is known of a recording beside them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from oed.cli.declarations.declared import INPUT
from robots.common.errors import InputError
from robots.common.options import Option

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

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
        from estimation.logs.torque_source import parse_meaning
        from estimation.regressions.torque_meanings import as_joint_torque, with_torque_constants

        if self.torque_is is not None:
            parse_meaning(self.torque_is, robot.n)
        robot = with_torque_constants(robot, logs if without is None else without, self.torque_is)
        return robot, [
            log
            if log.tau is None and log.current is None
            else as_joint_torque(robot, log, self.torque_is, estimate=False)
            for log in logs
        ]


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
        from dataclasses import replace

        loads = _by_number("--payload", self.payload, _payload, len(logs))
        fields = _by_number("--gravity", getattr(self, "gravity", ()), _gravity, len(logs))
        result = []
        for number, log in enumerate(logs, start=1):
            if number in loads:
                log = replace(log, payload=loads[number])
            if number in fields:
                log = replace(log, gravity=fields[number])
            result.append(log)
        return result

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


def _by_number(
    option: str, texts: Sequence[str], read: Callable[[str], NDArray[np.float64]], count: int
) -> dict[int, NDArray[np.float64]]:
    found: dict[int, NDArray[np.float64]] = {}
    everywhere: NDArray[np.float64] | None = None
    for text in texts:
        name, equals, values = text.partition("=")
        if not equals:
            name, values = "0", text
        try:
            number, value = int(name), read(values)
        except ValueError:
            raise InputError(f"{option} {text}", allowed=_EXAMPLES[option]) from None
        if not equals:
            if everywhere is not None:
                raise InputError(f"{option} without a number twice", allowed="one for all logs")
            everywhere = value
            continue
        if not 1 <= number <= count:
            raise InputError(
                f"{option} of log {number}", allowed=f"1 to {count}, the number of the log in reading order"
            )
        if number in found:
            raise InputError(f"{option} of log {number} twice", allowed="one per log")
        found[number] = value
    return found if everywhere is None else {**dict.fromkeys(range(1, count + 1), everywhere), **found}


_EXAMPLES = {
    "--payload": (
        "NUMBER=KG,X,Y,Z or NUMBER=payload.json; 2=5,0,0,0.1 means log 2 with 5 kg, centred 0.1 m in front of the "
        "flange"
    ),
    "--gravity": "NUMBER=X,Y,Z; 2=0,-2.54,-9.48 means log 2 with the base tilted by 15 degrees",
}


def _payload(values: str) -> NDArray[np.float64]:
    """Reads KG,X,Y,Z, or a payload.json: ten inertial parameters in the flange's frame."""
    from estimation.payloads.body import read_body
    from robots.terms.situations.flange_body import point_mass

    if values.endswith(".json") or (values and Path(values).exists()):
        return read_body(values).parameters
    mass, x, y, z = map(float, values.split(","))
    return point_mass(mass, (x, y, z))


def _gravity(values: str) -> NDArray[np.float64]:
    """Reads X,Y,Z."""
    import numpy as np

    x, y, z = map(float, values.split(","))
    return np.array([x, y, z])
