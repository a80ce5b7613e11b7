"""What the command line tells of logs: what the robot carried, and how its base stood."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from robots.signals import Log

PayloadOption = Annotated[
    list[str] | None,
    typer.Option(
        "--payload",
        help="A log that carries a known payload, as NUMBER=KG,X,Y,Z: its centre [m] in the flange's frame.",
        show_default=False,
    ),
]
GravityOption = Annotated[
    list[str] | None,
    typer.Option(
        "--gravity",
        help="A log of a base that stood otherwise, as NUMBER=X,Y,Z: gravity [m/s2] in the base frame.",
        show_default=False,
    ),
]


def told(logs: Sequence[Log], payloads: list[str] | None, gravities: list[str] | None) -> list[Log]:
    """Tells logs, counted from 1 in the order of reading, what they carry and how their base stood.

    Args:
        logs: as they were read.
        payloads: each NUMBER=KG,X,Y,Z, a point mass [kg] and its place [m] in the flange's frame.
        gravities: each NUMBER=X,Y,Z [m/s2], in the base frame.

    Raises:
        InputError: a text of another form, a number without a log, or one that is told twice.
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
    for text in texts:
        name, _, values = text.partition("=")
        try:
            number, value = int(name), read(values)
        except ValueError:
            raise InputError(f"{option} {text}", allowed=_EXAMPLES[option]) from None
        if not 1 <= number <= count:
            raise InputError(f"{option} of log {number}", allowed=f"1 to {count}: the logs in the order they are read")
        if number in found:
            raise InputError(f"{option} of log {number} twice", allowed="once a log")
        found[number] = value
    return found


_EXAMPLES = {
    "--payload": ("NUMBER=KG,X,Y,Z, as 2=5,0,0,0.1 for 5 kg a tenth of a metre ahead of the flange in the second log"),
    "--gravity": "NUMBER=X,Y,Z, as 2=0,-2.54,-9.48 for a base that was tilted by 15 degrees in the second log",
}


def _payload(values: str) -> NDArray[np.float64]:
    """Reads KG,X,Y,Z: the ten inertial parameters of a point mass."""
    from robots.terms.situations.flange_body import point_mass

    mass, x, y, z = map(float, values.split(","))
    return point_mass(mass, (x, y, z))


def _gravity(values: str) -> NDArray[np.float64]:
    """Reads X,Y,Z."""
    import numpy as np

    x, y, z = map(float, values.split(","))
    return np.array([x, y, z])
