"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from robots.common.errors import InputError

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from estimation.logs.mappings.mapping import LogMapping
    from robots.robot import Robot

ROBOT = "a catalogue name (er3a, ur10, panda), a URDF or xacro, an MJCF (MuJoCo), or a robot YAML"

RobotOption = Annotated[str, typer.Option("--robot", help=f"The robot: {ROBOT}.", show_default=False)]
MjcfOption = Annotated[
    Path | None,
    typer.Option("--mjcf", help="Also write a MuJoCo model (MJCF) with what was identified.", show_default=False),
]
TipOption = Annotated[
    str | None,
    typer.Option("--tip", help="URDF or MJCF with branches: the link at which the chain ends.", show_default=False),
]
JointsOption = Annotated[
    str | None,
    typer.Option(
        "--joints", help="URDF or MJCF with branches: the joints of the chain, comma-separated.", show_default=False
    ),
]
LockOption = Annotated[
    list[str] | None,
    typer.Option(
        "--lock", help="Hold a joint at a position [rad or m], as name=value. Repeatable.", show_default=False
    ),
]
UnlimitedOption = Annotated[
    bool, typer.Option("--unlimited", help="URDF: accept revolute and prismatic joints without position limits.")
]
AssumeMassesOption = Annotated[
    float | None,
    typer.Option(
        "--assume-masses",
        metavar="KG",
        help="For a description without masses: assume those of a usual arm of its size and this rated payload [kg]. "
        "All results say so.",
        show_default=False,
    ),
]
LogOption = Annotated[
    list[Path], typer.Option("--log", help="A log, or a folder of logs. Repeatable.", show_default=False)
]
MappingOption = Annotated[
    Path | None,
    typer.Option(
        "--mapping", help="A YAML file with names, units, signs and order of the log's columns.", show_default=False
    ),
]
RateOption = Annotated[
    float | None,
    typer.Option(
        "--rate",
        metavar="HZ",
        help="Rows per second of a log without a column of time. It replaces a column that does not hold the time.",
        show_default=False,
    ),
]
ForceOption = Annotated[bool, typer.Option("--force", help="Overwrite existing results.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
QuietOption = Annotated[bool, typer.Option("--quiet", help="Print only errors.")]
SeedOption = Annotated[int, typer.Option("--seed", min=0, help="Seed of the random numbers.")]
WorkersOption = Annotated[
    int | None,
    typer.Option("--workers", min=1, help="Number of parallel processes. Default: one per core.", show_default=False),
]
ClusterOption = Annotated[
    str | None,
    typer.Option(
        "--cluster",
        metavar="ADDRESS",
        help="Address of a Dask scheduler whose workers do the work, such as tcp://host:8786, instead of processes of "
        "this machine.",
        show_default=False,
    ),
]
OutOption = Annotated[Path, typer.Option("--out", help="Folder for the results.")]
FrictionOption = Annotated[str, typer.Option("--friction", help="Friction model: polynomial or coulomb-viscous.")]
FittedFrictionOption = Annotated[
    str,
    typer.Option(
        "--friction",
        help="Friction model: auto (bends within the recorded speeds, grows linearly beyond), polynomial or "
        "coulomb-viscous.",
    ),
]
FamilyOption = Annotated[
    str, typer.Option("--family", help="Family of the optimised part: fourier, bspline or fourier-polynomial.")
]
HarmonicsOption = Annotated[
    int, typer.Option("--harmonics", help="Number of harmonics; a B-spline gets as many coefficients per joint.")
]
BaseFrequencyOption = Annotated[
    float, typer.Option("--base-frequency", help="Frequency of the first harmonic: one over the period [Hz].")
]
CollisionOption = Annotated[
    bool,
    typer.Option(
        help=(
            "Avoid collisions with the robot itself, the floor and the obstacles in the robot file. Without it, all "
            "files say that the motion was not checked."
        )
    ),
]
FloorOption = Annotated[
    float | None,
    typer.Option(
        "--floor",
        help=(
            "Height of the floor in the base frame [m]. Default: that of the robot file, else the plane that the base "
            "is mounted on."
        ),
        show_default=False,
    ),
]
NoFloorOption = Annotated[bool, typer.Option("--no-floor", help="There is no floor, as under a robot on a pedestal.")]
KeepOutOption = Annotated[
    list[str] | None,
    typer.Option(
        "--keep-out",
        help="Box that the arm must not enter, in the base frame: xmin,xmax,ymin,ymax,zmin,zmax [m]. Repeat for more.",
        show_default=False,
    ),
]
VelocityFractionOption = Annotated[
    float | None,
    typer.Option(
        "--velocity-fraction",
        help=(
            "Fraction of the velocity limits to use. Default: 1 for robots of the catalogue, 0.5 for others, whose "
            "first motion should be slower."
        ),
        show_default=False,
    ),
]
TorqueMarginOption = Annotated[
    float, typer.Option("--torque-margin", help="Fraction of the torque limits to keep as reserve.")
]
PngOption = Annotated[bool, typer.Option("--png", help="Also write the report's figures as PNG files.")]


def robot_from(
    spec: str,
    tip: str | None = None,
    joints: str | None = None,
    lock: list[str] | None = None,
    *,
    unlimited: bool = True,
    assume_masses: float | None = None,
) -> Robot:
    """Loads the robot that the options name.

    Only commands that plan a motion need position limits; they pass what `--unlimited` says.

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
            raise InputError(
                f"--lock {item}", allowed="name=value with the value in rad or m, such as elbow_joint=1.57"
            ) from None
    names = [name.strip() for name in joints.split(",")] if joints else None
    return load_robot(
        spec, tip=tip, joints=names, locked=locked or None, unlimited=unlimited, assume_masses=assume_masses
    )


def with_rate(mapping: Path | None, rate: float | None) -> LogMapping | Path | None:
    """Gives the mapping that `--mapping` and `--rate` state together.

    Raises:
        InputError: a rate that is not positive, or beside a column of time that the mapping names.
    """
    if rate is None:
        return mapping
    from estimation.logs.mappings.mapping import stated_rate

    return stated_rate(rate, mapping)


def robot_of_file(
    robot: str | None,
    metadata: Mapping[str, Any],
    file: Path,
    tip: str | None = None,
    joints: str | None = None,
    lock: list[str] | None = None,
) -> Robot:
    """Loads the robot that an option names, else the one that a trajectory file names.

    Args:
        robot: of the option.
        metadata: of the file.
        file: for the message.
        tip: see `robot_from`.
        joints: see `robot_from`.
        lock: see `robot_from`.

    Raises:
        InputError: neither names one; or see `robot_from`.
    """
    stated = str(metadata.get("robot") or "")
    if not robot and not stated:
        raise InputError("the file does not name its robot", file=file, remedy="give --robot")
    if not robot and Path(stated).suffix and not Path(stated).is_file():
        raise InputError(f"the file names the robot {stated}, which is not there", file=file, remedy="give --robot")
    return robot_from(robot or stated, tip, joints, lock)


@contextmanager
def executor_from(workers: int | None, cluster: str | None) -> Iterator[Executor | None]:
    """Connects to the cluster that the options name; None without one, for processes of this machine.

    Raises:
        InputError: both options, or see `robots.common.clusters.cluster`.
    """
    if cluster is None:
        yield None
        return
    if workers is not None:
        raise InputError(
            "--workers together with --cluster",
            allowed="one of them",
            remedy="the number of a cluster's workers is decided where they are started",
        )
    from robots.common.clusters import cluster as connect

    with connect(cluster) as executor:
        yield executor


def numbers(option: str, text: str | None) -> list[float] | None:
    """Reads comma-separated numbers.

    Raises:
        InputError: the text is something else.
    """
    if text is None:
        return None
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise InputError(f"{option} {text}", allowed="numbers, separated by commas") from None
