"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from robots.common.errors import InputError

if TYPE_CHECKING:
    from robots.robot import Robot

ROBOT = "a catalogue name (er3a, ur10, panda), a URDF, or a robot YAML"

RobotOption = Annotated[str, typer.Option("--robot", help=f"The robot: {ROBOT}.", show_default=False)]
TipOption = Annotated[
    str | None, typer.Option("--tip", help="Of a branched URDF: the link at which the chain ends.", show_default=False)
]
JointsOption = Annotated[
    str | None,
    typer.Option("--joints", help="Of a branched URDF: the chain's joints, separated by commas.", show_default=False),
]
LockOption = Annotated[
    list[str] | None,
    typer.Option("--lock", help="A joint held at a value [rad or m], as name=value.", show_default=False),
]
LogOption = Annotated[
    list[Path], typer.Option("--log", help="A log, or a folder of logs; may be given again.", show_default=False)
]
MappingOption = Annotated[
    Path | None,
    typer.Option("--mapping", help="A YAML file: names, units, signs and order of the columns.", show_default=False),
]
ForceOption = Annotated[bool, typer.Option("--force", help="Overwrite results that are there.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
QuietOption = Annotated[bool, typer.Option("--quiet", help="Print nothing but errors.")]
SeedOption = Annotated[int, typer.Option("--seed", min=0, help="Seed of everything random.")]
WorkersOption = Annotated[
    int | None,
    typer.Option("--workers", min=1, help="Parallel processes; as many as cores by default.", show_default=False),
]
OutOption = Annotated[Path, typer.Option("--out", help="Folder for the results.")]
FrictionOption = Annotated[str, typer.Option("--friction", help="The model to fit: polynomial or coulomb-viscous.")]
FamilyOption = Annotated[
    str, typer.Option("--family", help="Of the optimised part: fourier, bspline or fourier-polynomial.")
]
HarmonicsOption = Annotated[
    int,
    typer.Option(
        "--harmonics", help="Harmonics N of the optimised part; another family gets about as many coefficients."
    ),
]
BaseFrequencyOption = Annotated[
    float, typer.Option("--base-frequency", help="One over the duration of one repetition [Hz].")
]
CollisionOption = Annotated[
    bool, typer.Option("--collision", help="Keep clear of the arm itself and of the obstacles in its file.")
]
VelocityFractionOption = Annotated[
    float, typer.Option("--velocity-fraction", help="Share of the velocity limits to use.")
]
TorqueMarginOption = Annotated[
    float, typer.Option("--torque-margin", help="Share of the torque limits kept in reserve.")
]
PngOption = Annotated[bool, typer.Option("--png", help="Write the report's pictures as PNG files, too.")]


def robot_from(spec: str, tip: str | None = None, joints: str | None = None, lock: list[str] | None = None) -> Robot:
    """Loads the robot that the options name.

    Raises:
        InputError: see `robots.loading.load_robot`; or a lock that is not name=value.
    """
    from robots.loading import load_robot

    locked = {}
    for item in lock or []:
        name, _, value = item.partition("=")
        try:
            locked[name.strip()] = float(value)
        except ValueError:
            raise InputError(f"--lock {item}", allowed="name=value, the value in rad or m") from None
    names = [name.strip() for name in joints.split(",")] if joints else None
    return load_robot(spec, tip=tip, joints=names, locked=locked or None)


def numbers(option: str, text: str | None) -> list[float] | None:
    """Reads numbers separated by commas.

    Raises:
        InputError: something else.
    """
    if text is None:
        return None
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise InputError(f"{option} {text}", allowed="numbers separated by commas") from None
