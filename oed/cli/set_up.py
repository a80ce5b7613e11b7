"""Known payloads and base orientations of logs, from the command line."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from estimation.logs.parquet_streams import LogStream
    from robots.robot import Robot
    from robots.signals import Log

Recorded = TypeVar("Recorded", "Log", "LogStream")

PayloadOption = Annotated[
    list[str] | None,
    typer.Option(
        "--payload",
        help=(
            "Known payload in a log, as NUMBER=KG,X,Y,Z: number of the log, mass [kg], centre of mass in the flange "
            "frame [m]; or NUMBER=payload.json. Without NUMBER= it applies to all logs."
        ),
        show_default=False,
    ),
]
CarriedOption = Annotated[
    str | None,
    typer.Option(
        "--payload",
        help=(
            "Payload on the flange: a payload.json, or KG,X,Y,Z: mass [kg] and centre of mass in the flange frame [m]."
        ),
        show_default=False,
    ),
]
GravityOption = Annotated[
    list[str] | None,
    typer.Option(
        "--gravity",
        help=(
            "Gravity in the base frame for a log with a tilted base, as NUMBER=X,Y,Z: number of the log, gravity "
            "[m/s2]. Without NUMBER= it applies to all logs."
        ),
        show_default=False,
    ),
]

TorqueIsOption = Annotated[
    str | None,
    typer.Option(
        "--torque-is",
        help=(
            "What the torque columns hold, if not joint torques: current, motor, or without-gravity. With joints if it "
            "concerns some only: motor:2,5."
        ),
        show_default=False,
    ),
]


def with_torque_meaning(
    robot: Robot, logs: Sequence[Log], torque_is: str | None, without: Sequence[Log] | None = None
) -> tuple[Robot, list[Log]]:
    """Converts torque columns of another meaning to joint torques, by the robot's description.

    Args:
        robot: of the logs.
        logs: with their payloads and gravity vectors; a log without torque stays as it is.
        torque_is: see `estimation.logs.torque_source.parse_meaning`; None for what the mapping states.
        without: those of the logs that have no unknown payload, by which torque constants are estimated; None for all.

    Returns:
        The robot, with estimated torque constants where it needs them, and the logs.

    Raises:
        InputError: an unknown meaning, or a description that lacks what is needed.
    """
    from estimation.logs.torque_source import parse_meaning
    from estimation.regressions.torque_meanings import as_joint_torque, with_torque_constants

    if torque_is is not None:
        parse_meaning(torque_is, robot.n)
    robot = with_torque_constants(robot, logs if without is None else without, torque_is)
    return robot, [
        log if log.tau is None and log.current is None else as_joint_torque(robot, log, torque_is, estimate=False)
        for log in logs
    ]


def with_known_setup(
    logs: Sequence[Recorded], payloads: list[str] | None, gravities: list[str] | None
) -> list[Recorded]:
    """Adds known payloads and gravity vectors to logs.

    Args:
        logs: in the order in which they were read; they are numbered from 1.
        payloads: each NUMBER=KG,X,Y,Z, a point mass [kg] and its position [m] in the flange's frame, or NUMBER=FILE, a
            payload.json; without the number of all logs that no other text names.
        gravities: each NUMBER=X,Y,Z [m/s2], in the base frame, or without the number.

    Raises:
        InputError: a text of another form, a number without a log, or a number given twice.
    """
    from dataclasses import replace

    loads = _by_number("--payload", payloads or [], _payload, len(logs))
    fields = _by_number("--gravity", gravities or [], _gravity, len(logs))
    result = []
    for number, log in enumerate(logs, start=1):
        if number in loads:
            log = replace(log, payload=loads[number])
        if number in fields:
            log = replace(log, gravity=fields[number])
        result.append(log)
    return result


def _by_number(
    option: str, texts: list[str], read: Callable[[str], NDArray[np.float64]], count: int
) -> dict[int, NDArray[np.float64]]:
    from robots.common.errors import InputError

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
