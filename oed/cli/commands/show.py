"""``oed show``: the robot in 3-D, playing a trajectory or a log."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from oed.cli.console import Console
from oed.cli.options import (
    ROBOT,
    ForceOption,
    JointsOption,
    JsonOption,
    LockOption,
    MappingOption,
    QuietOption,
    RateOption,
    TipOption,
    robot_of_file,
    with_rate,
)

if TYPE_CHECKING:
    from robots.robot import Robot


def show(
    motion: Annotated[Path, typer.Argument(help="A trajectory.csv, or a log.", show_default=False)],
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot", help=f"The robot: {ROBOT}. Default: the robot named in the trajectory file.", show_default=False
        ),
    ] = None,
    mapping: MappingOption = None,
    rate: RateOption = None,
    diagnosis: Annotated[
        Path | None,
        typer.Option(
            "--diagnosis",
            help="A diagnosis.json, or its folder: joints with a finding are marked.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[Path, typer.Option("--out", help="HTML file to write.")] = Path("robot.html"),
    tip: TipOption = None,
    joints: JointsOption = None,
    lock: LockOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Writes a page with the robot in 3-D, which plays a trajectory or a log.

    The page needs no network. Limits light up as the motion approaches them.
    """
    console = Console(json=json, quiet=quiet)
    with console.working():
        from estimation import read_log
        from oed.exports import is_made_for, read_trajectory
        from oed.reports import animate, motion_page, render
        from oed.reports.rendering.provenance import recordings_from
        from robots.common.errors import OtherRobotWarning
        from robots.common.files import existing_file, open_atomic
        from robots.signals import Log, Motion

        # Opened before the work: an existing file ends the command early, and an error leaves no file behind.
        with open_atomic(out, force=force) as page_file:
            existing_file(motion)
            played: Motion | Log
            stated: dict[str, Any] = {}
            planned = mapping is None and rate is None and _is_trajectory(motion)
            if planned:
                played, stated = read_trajectory(motion)
            described = robot_of_file(robot, stated, motion, tip, joints, lock)
            made_for = str(stated.get("robot") or described.name)
            if not is_made_for(made_for, described):
                text = f"{motion.name} was made for {made_for}; {described.name} is used (--robot)"
                warnings.warn(OtherRobotWarning(text), stacklevel=1)
            if not planned:
                played = read_log(
                    motion,
                    n=described.n,
                    torque=False,
                    mapping=with_rate(mapping, rate),
                    joints=described.joint_names,
                    kinds=described.chain.kinds,
                )
            marks, findings = _findings(diagnosis, described) if diagnosis else ({}, ())
            animation = animate(described, played, marks=marks)
            logs = recordings_from([played]) if isinstance(played, Log) else ()
            page_file.write(render(motion_page(animation, logs=logs, findings=findings)).encode())
    margins = [
        {"quantity": m.quantity, "joint": m.joint, "slack_fraction": m.slack_fraction, "time": m.time}
        for m in animation.approaches
    ]
    data = {
        "file": str(out),
        "robot": described.name,
        "duration": animation.duration,
        "bodies": len(animation.bodies),
        "marked_joints": sorted(animation.marks),
        "closest_approaches": margins,
    }
    console.result(f"{animation.summary()}\nwritten to {out}", data)


def _is_trajectory(path: Path) -> bool:
    """Says whether a CSV has velocities and accelerations and nothing that was measured."""
    if path.suffix.lower() != ".csv":
        return False
    with path.open(encoding="utf-8", errors="replace") as stream:
        header = next((line for line in stream if not line.startswith("#")), "")
    names = {word.strip().lower() for word in header.split(",")}
    return {"t", "q1", "dq1", "ddq1"} <= names and not names & {"tau1", "i1", "temp1"}


def _findings(path: Path, robot: Robot) -> tuple[dict[int, str], Any]:
    """Reads the joints that a diagnosis marks, and its findings."""
    from estimation.diagnosis.results.diagnosis import Diagnosis
    from oed.reports.pages.motions.diagnosis_motion import joint_marks
    from robots.common.errors import InputError
    from robots.common.records import Finding, effect_code

    found = Diagnosis.load(path.parent if path.name == "diagnosis.json" else path).findings
    beyond = next((f for f in found if f.joint is not None and f.joint > robot.n), None)
    if beyond is not None:
        raise InputError(
            f"a finding at joint {beyond.joint}, but {robot.name} has {robot.n} joints",
            file=path,
            remedy="choose the diagnosis of this robot",
        )
    findings = tuple(
        Finding(
            code=effect_code(f.effect) if f.named else "diagnosis.unexplained",
            subject=f"Joint {f.joint}:" if f.joint else "",
            text=f.sentence,
        )
        for f in found
    )
    return joint_marks(found), findings
