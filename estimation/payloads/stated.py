"""Known payloads and base orientations of logs, stated in texts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from estimation.logs.parquet_streams import LogStream
from estimation.payloads.body import read_body
from robots.common.errors import InputError
from robots.robot import Robot
from robots.signals import Log
from robots.terms.situations.flange_body import point_mass

Recorded = TypeVar("Recorded", Log, LogStream)


def with_stated_setup(
    logs: Sequence[Recorded], *, payloads: Sequence[str] = (), gravities: Sequence[str] = ()
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
    loads = _by_number("--payload", payloads, _payload, len(logs))
    fields = _by_number("--gravity", gravities, _gravity, len(logs))
    result = []
    for number, log in enumerate(logs, start=1):
        if number in loads:
            log = replace(log, payload=loads[number])
        if number in fields:
            log = replace(log, gravity=fields[number])
        result.append(log)
    return result


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
    if values.endswith(".json") or (values and Path(values).exists()):
        return read_body(values).parameters
    mass, x, y, z = map(float, values.split(","))
    return point_mass(mass, (x, y, z))


def _gravity(values: str) -> NDArray[np.float64]:
    """Reads X,Y,Z."""
    x, y, z = map(float, values.split(","))
    return np.array([x, y, z])


def loaded_robot(known: Robot, stated: Robot | None) -> Robot:
    """Gives the robot of logs with a payload: as it is stated, with the torque constants that only the model knows.

    Args:
        known: the model's robot.
        stated: the same robot by another description; None for the model's.

    Raises:
        InputError: a robot of other joints, or with another flange than the model's.
    """
    if stated is None:
        return known
    if stated.n != known.n:
        raise InputError(f"a model of {known.n} joints", allowed=f"{stated.n}, as {stated.name} has")
    zero = np.zeros((1, stated.n))
    if not np.allclose(stated.chain.flange(zero), known.chain.flange(zero), atol=1e-4):
        raise InputError(
            f"the flange of {stated.name} is elsewhere than that of the model's robot",
            remedy="leave --robot out, state the flange by --frame, or identify the model with this robot",
        )
    constants = np.asarray(stated.torque_constant)
    filled = np.where(np.isnan(constants), known.torque_constant, constants)
    return replace(stated, torque_constant=filled)
