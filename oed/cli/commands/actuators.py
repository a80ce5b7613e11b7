"""``oed actuators``: drives of a robot from commands and positions, without torque."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from oed.cli.console import Console
from oed.cli.options import (
    ROBOT,
    ForceOption,
    JsonOption,
    LockOption,
    LogOption,
    MappingOption,
    OutOption,
    PngOption,
    QuietOption,
    RateOption,
    SeedOption,
    with_rate,
)
from robots.common.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from robots.common.progress import Progress
    from robots.robot import Robot
    from robots.signals import Log

T = TypeVar("T")


def actuators(
    robot: Annotated[
        str,
        typer.Option("--robot", help=f"The robot: {ROBOT}. Branches are read from a base that is held."),
    ],
    log: LogOption,
    gains: Annotated[
        Path | None,
        typer.Option(
            "--gains",
            help="A YAML file with the control law and its gains. Default: the actuators of the MJCF.",
            show_default=False,
        ),
    ] = None,
    held_out: Annotated[
        list[Path] | None,
        typer.Option(
            "--held-out",
            help="A log that nothing is fitted to. Repeatable. Default: the last 30 % of each run is held out.",
            show_default=False,
        ),
    ] = None,
    share: Annotated[
        str | None,
        typer.Option(
            "--share",
            help="Parts of joint names, comma-separated, whose joints share parameters: hip,thigh,calf; or all.",
            show_default=False,
        ),
    ] = None,
    free: Annotated[
        str | None,
        typer.Option(
            "--free",
            help="Parameters to identify beside delay, armature, friction and offset, comma-separated: kp,kd.",
            show_default=False,
        ),
    ] = None,
    effects: Annotated[bool, typer.Option(help="Look for effects beyond these.")] = True,
    mapping: MappingOption = None,
    rate: RateOption = None,
    joints: Annotated[
        str | None,
        typer.Option(
            "--joints",
            help="The joints of the log in its order, comma-separated; others are locked.",
            show_default=False,
        ),
    ] = None,
    lock: LockOption = None,
    seed: SeedOption = 0,
    out: OutOption = Path("drives"),
    png: PngOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Identifies delay, rotor inertia, friction and gains of drives from commands and positions.

    Needs no torque. Writes actuators.json, motion.parquet, parameters.csv, drives.xml (MuJoCo), isaac_lab.py,
    newton.json, for a URDF drives.urdf, and report.html.
    """
    console = Console(json=json, quiet=quiet)
    with console.working() as progress:
        from estimation.actuators import ActuatorOptions, identify_actuators
        from estimation.actuators.exports import simulator_files
        from oed.reports import save_actuators_report
        from robots.common.files import ResultFolder
        from robots.drives import described_drives
        from robots.drives.branches import load_branches

        names = ("actuators.json", "motion.parquet", "parameters.csv", "report.html")
        with ResultFolder(out, force, names=names) as folder:
            chains = load_branches(robot, joints=named(joints), locked=positions(lock))
            known = described_drives(chains, gains)
            order = _joint_order(chains, named(joints))
            kinds = tuple(kind for chain in chains for kind in chain.chain.kinds)
            read: dict[str, Any] = {
                "n": len(order.names),
                "torque": False,
                "mapping": with_rate(mapping, rate),
                "joints": order.names,
                "kinds": order.put(kinds),
            }
            limits = _limits_of(chains, order)
            logs = [order.sorted(one) for one in _logs_from(log, limits, read)]
            outside = [order.sorted(one) for one in _logs_from(held_out or [], limits, read)]
            options = ActuatorOptions(
                share=named(share) or (), free=(*(named(free) or ()), *known.unknown), effects=effects, seed=seed
            )
            result = identify_actuators(
                chains, logs, known.drives, held_out=outside, options=options, progress=progress
            )
            result.save(folder.path("actuators.json").parent)
            result.to_frame().to_csv(folder.path("parameters.csv"), index=False)
            written = simulator_files(result, out)
            for name, text in written.files.items():
                folder.path(name).write_text(text, encoding="utf-8")
            save_actuators_report(result, folder, png=png)
    lines = [result.summary(), *(f"  {remark}" for remark in written.remarks), f"written to {out.resolve()}"]
    console.result("\n".join(lines), result.to_dict())


@dataclass(frozen=True)
class _JointOrder:
    """The joints of a log in its order, and where each chain's joints are among them.

    Attributes:
        names: of the log's joints.
        places: of the chains' joints among them.
    """

    names: tuple[str, ...]
    places: tuple[int, ...]

    def put(self, values: Sequence[T]) -> tuple[T, ...]:
        """Puts one value per joint of the chains into the order of the log."""
        return tuple(values[self.places.index(k)] for k in range(len(self.places)))

    def sorted(self, log: Log) -> Log:
        """Puts a log's joints into the order of the chains."""
        order = list(self.places)
        if order == sorted(order):
            return log
        kept = {
            key: value[:, order]
            for key in ("q", "command", "tau", "current", "dq", "ddq", "temperature", "qlink")
            if (value := getattr(log, key)) is not None
        }
        return replace(log, **kept)


def _joint_order(chains: Sequence[Robot], stated: Sequence[str] | None) -> _JointOrder:
    """Finds the order of a log's joints: as stated, else that of the chains."""
    names = tuple(name for chain in chains for name in chain.joint_names)
    if stated is None:
        return _JointOrder(names, tuple(range(len(names))))
    return _JointOrder(tuple(stated), tuple(list(stated).index(name) for name in names))


def _limits_of(chains: Sequence[Robot], order: _JointOrder) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gives lower and upper positions of a log's joints in its order [rad or m]."""
    import numpy as np

    lower = [float(value) for chain in chains for value in chain.limits.lower]
    upper = [float(value) for chain in chains for value in chain.limits.upper]
    return np.array(order.put(lower)), np.array(order.put(upper))


def _logs_from(
    paths: Sequence[Path], limits: tuple[NDArray[np.float64], NDArray[np.float64]], options: Mapping[str, Any]
) -> list[Log]:
    """Reads logs with commands: files of any known format, and LeRobot data sets.

    Args:
        paths: files and folders.
        limits: of the joints, by which normalised positions of a data set are read.
        options: of `read_logs`.

    Raises:
        InputError: see `read_logs` and `read_lerobot`.
    """
    from estimation.logs import read_logs
    from estimation.logs.readers.lerobot import is_lerobot, read_lerobot

    sets = [path for path in paths if is_lerobot(path)]
    files = [path for path in paths if path not in sets]
    found = list(read_logs(files, **options)) if files else []
    for path in sets:
        found += read_lerobot(path, options["joints"], limits)
    return found


def named(text: str | None) -> tuple[str, ...] | None:
    """Reads names, separated by commas."""
    return tuple(part.strip() for part in text.split(",") if part.strip()) if text else None


def positions(lock: Sequence[str] | None) -> dict[str, float] | None:
    """Reads positions of locked joints, each name=value [rad or m].

    Raises:
        InputError: something else.
    """
    found = {}
    for item in lock or ():
        name, _, value = item.partition("=")
        try:
            found[name.strip()] = float(value)
        except ValueError:
            raise InputError(f"--lock {item}", allowed="name=value with the value in rad or m") from None
    return found or None


def design_for_drives(
    robot: str,
    gains: Path | None,
    *,
    lock: Sequence[str] | None,
    joints: str | None,
    home: Sequence[float] | None,
    duration: float,
    seed: int,
    out: Path,
    force: bool,
    progress: Progress,
) -> tuple[str, dict[str, Any]]:
    """Designs the commands and writes commands.csv, design.json and report.html.

    Raises:
        InputError: see `load_branches`, `described_drives` and `design_drive_motion`.
        InfeasibleError: no motion stays within the limits.
    """
    from oed.experiments.drives import DriveDesignOptions, design_drive_motion
    from oed.reports import save_drive_design_report
    from robots.common.files import ResultFolder
    from robots.drives import described_drives, load_branches

    with ResultFolder(out, force, names=["commands.csv", "design.json", "report.html"]) as folder:
        chains = load_branches(robot, joints=named(joints), locked=positions(lock))
        known = described_drives(chains, gains)
        options = DriveDesignOptions(duration=duration, seed=seed, home=None if home is None else tuple(home))
        result = design_drive_motion(chains, known.drives, options=options, progress=progress)
        result.save(folder.path("commands.csv").parent)
        save_drive_design_report(result, folder)
    return result.summary(), result.to_dict()
