"""``oed export``: a trajectory in a controller's format."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Annotated

import typer

from oed.cli.console import Console
from oed.cli.options import (
    ROBOT,
    ForceOption,
    JointsOption,
    JsonOption,
    LockOption,
    QuietOption,
    TipOption,
    robot_of_file,
)


def export(
    trajectory: Annotated[Path, typer.Argument(help="A trajectory.csv.", show_default=False)],
    to: Annotated[
        str,
        typer.Option(
            "--to",
            help=(
                "Format: csv, ros, ros-goal, rosbag, mcap, moveit-limits, simple-message, urscript, kuka, abb, "
                "abb-egm, franka or franka-player."
            ),
        ),
    ] = "csv",
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            help="File to write. Default: beside the trajectory, with the format in its name.",
            show_default=False,
        ),
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot", help=f"The robot: {ROBOT}. Default: the robot named in the trajectory file.", show_default=False
        ),
    ] = None,
    period: Annotated[
        float | None,
        typer.Option(
            "--period", help="Sample period of the controller [s]. Default: see the page.", show_default=False
        ),
    ] = None,
    start_tolerance: Annotated[
        float,
        typer.Option("--start-tolerance", help="Tolerance of the start pose in programs and ros-goal [rad or m]."),
    ] = 0.01,
    name: Annotated[
        str | None,
        typer.Option(
            "--name",
            help="Programs: name of the program or module. Default: that of the file for kuka and abb, else "
            "trajectory.",
            show_default=False,
        ),
    ] = None,
    degrees: Annotated[
        bool, typer.Option("--degrees", help="csv: angles in degrees; linear axes stay in metres.")
    ] = False,
    positions_only: Annotated[bool, typer.Option("--positions-only", help="csv: only t and q1..qn.")] = False,
    bare: Annotated[
        bool, typer.Option("--bare", help="csv: the column names without the comment block above them.")
    ] = False,
    tip: TipOption = None,
    joints: JointsOption = None,
    lock: LockOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Writes a trajectory file for a robot controller or a simulator."""
    console = Console(json=json, quiet=quiet)
    with console.working():
        from oed.exports import (
            CONTROLLER_FORMS,
            FORMS,
            ExportOptions,
            check_trajectory,
            export_trajectory,
            read_trajectory,
            write_trajectory,
        )
        from oed.exports.forms.sampling import at_period
        from oed.exports.trajectory_checks import stated_collisions
        from robots.common.errors import AssumedValueWarning, InputError

        if to not in FORMS:
            raise InputError(f"--to {to}", allowed=", ".join(FORMS))
        if to != "csv" and (degrees or positions_only or bare):
            raise InputError(f"--degrees, --positions-only or --bare with --to {to}", allowed="them with csv only")
        suffix = ".csv" if to == "csv" else CONTROLLER_FORMS[to].suffixes[0]
        named = to != "csv" and CONTROLLER_FORMS[to].named
        program = name or (out.stem if named and out is not None else "trajectory")
        # Controllers look for a program in the file of its name.
        target = out or trajectory.with_name(f"{program if named else f'{trajectory.stem}-{to}'}{suffix}")
        motion, metadata = read_trajectory(trajectory)
        collisions, proved = stated_collisions(metadata)
        if not proved:
            warnings.warn(f"{trajectory}: {collisions} Do not play it.", AssumedValueWarning, stacklevel=1)
        # Only the trajectory file itself can be written without knowing whose joints move.
        unknown = to == "csv" and not robot and not metadata.get("robot")
        described = None if unknown else robot_of_file(robot, metadata, trajectory, tip, joints, lock)
        if described is None or to == "csv":
            if described is None:
                text = f"{trajectory} names no robot: the limits were not checked; state the robot with --robot"
                warnings.warn(text, AssumedValueWarning, stacklevel=1)
                kinds = metadata.get("kinds")
            else:
                check_trajectory(motion, described, metadata, trajectory)
                kinds = described.chain.kinds
            if degrees and kinds is None:
                text = (
                    f"{trajectory} states no units: all joints are taken as revolute; --robot states which axes are "
                    "linear"
                )
                warnings.warn(text, AssumedValueWarning, stacklevel=1)
            if period is not None:
                motion = at_period(motion, period)
                metadata.pop("period", None)
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
        else:
            options = ExportOptions(start_tolerance=start_tolerance, name=program)
            motion = export_trajectory(
                target,
                motion,
                described,
                to,
                period=period,
                options=options,
                metadata=metadata,
                file=trajectory,
                force=force,
            )
    has_samples = to == "csv" or CONTROLLER_FORMS[to].has_samples
    data = {
        "file": str(target),
        "form": to,
        "samples": len(motion) if has_samples else None,
        "joints": motion.n,
        "period": motion.period if has_samples else None,
        "collisions": collisions,
    }
    limits = "limits of velocity, acceleration and jerk" if to == "moveit-limits" else "a program for trajectories"
    content = f"{len(motion)} samples" if has_samples else limits
    console.result(f"{content} of {motion.n} joints written to {target}", data)
