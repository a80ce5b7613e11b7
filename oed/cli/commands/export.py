"""``oed export``: a trajectory in a controller's format."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Annotated

import typer

from oed.cli.console import Console
from oed.cli.options import ROBOT, ForceOption, JsonOption, QuietOption, robot_from


def export(
    trajectory: Annotated[Path, typer.Argument(help="A trajectory.csv.", show_default=False)],
    to: Annotated[str, typer.Option("--to", help="Format: csv.")] = "csv",
    out: Annotated[
        Path | None, typer.Option("--out", help="File to write. Default: next to the trajectory.", show_default=False)
    ] = None,
    degrees: Annotated[
        bool, typer.Option("--degrees", help="Write angles in degrees; linear axes stay in metres.")
    ] = False,
    positions_only: Annotated[bool, typer.Option("--positions-only", help="Write only t and q1..qn.")] = False,
    bare: Annotated[
        bool, typer.Option("--bare", help="Write the column names without the comment block above them.")
    ] = False,
    robot: Annotated[
        str | None,
        typer.Option("--robot", help=f"For a file without units: the robot, {ROBOT}.", show_default=False),
    ] = None,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Writes a trajectory file for a robot controller."""
    console = Console(json=json, quiet=quiet)
    with console.working():
        from oed.exports import FORMS, read_trajectory, write_trajectory
        from robots.common.errors import AssumedValueWarning, InputError

        if to not in FORMS:
            raise InputError(f"--to {to}", allowed=", ".join(FORMS))
        motion, metadata = read_trajectory(trajectory)
        kinds = robot_from(robot).chain.kinds if robot else metadata.get("kinds")
        if degrees and kinds is None:
            text = (
                f"{trajectory} states no units: all joints are taken as revolute; --robot states which axes are linear"
            )
            warnings.warn(text, AssumedValueWarning, stacklevel=1)
        target = out or trajectory.with_name(f"{trajectory.stem}-export.csv")
        write_trajectory(
            target,
            motion,
            metadata,
            kinds=kinds,
            degrees=degrees,
            positions_only=positions_only,
            bare=bare,
            force=force,
        )
    data = {"file": str(target), "form": to, "samples": len(motion), "joints": motion.n}
    console.result(f"{len(motion)} samples of {motion.n} joints written to {target}", data)
