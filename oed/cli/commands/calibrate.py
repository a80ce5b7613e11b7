"""``oed calibrate``: joint zeros, links, base and tool from measured poses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from oed.cli.console import Console
from oed.cli.options import (
    AssumeMassesOption,
    ForceOption,
    JointsOption,
    JsonOption,
    LockOption,
    OutOption,
    PngOption,
    QuietOption,
    RobotOption,
    SeedOption,
    TipOption,
    numbers,
    robot_from,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from estimation.calibrations import TableOptions
    from robots.geometry_errors import MeasuredPoses

FILES = (
    *("calibration.json", "report.html", "robot.urdf", "robot.xml", "robot.yaml"),
    *("dh_modified.csv", "dh_standard.csv", "joint_zeros.yaml"),
)


def calibrate(
    robot: RobotOption,
    poses: Annotated[
        Path, typer.Option("--poses", help="A table of measured poses (CSV or Parquet).", show_default=False)
    ],
    held_out: Annotated[
        Path | None,
        typer.Option("--held-out", help="Poses of another session, to check the result on.", show_default=False),
    ] = None,
    second: Annotated[
        str | None,
        typer.Option("--second", help="The second arm, for a part that both arms hold.", show_default=False),
    ] = None,
    lengths: Annotated[str, typer.Option("--lengths", help="Unit of measured lengths: m or mm.")] = "m",
    angles: Annotated[
        str, typer.Option("--angles", help="Unit of joint positions and measured angles: rad or deg.")
    ] = "rad",
    quaternion: Annotated[
        str, typer.Option("--quaternion", help="Order of the four columns of a quaternion: xyzw or wxyz.")
    ] = "xyzw",
    kinds: Annotated[
        str | None,
        typer.Option(
            "--kinds",
            help="Kinds of errors to fit, comma-separated: joint_zero, link_placement, gear_ratio, eccentricity, "
            "joint_compliance, link_compliance, thermal_growth, backlash, time_offset, base_motion. Default: those "
            "that held-out poses support.",
            show_default=False,
        ),
    ] = None,
    known: Annotated[
        list[str] | None,
        typer.Option(
            "--known",
            help="A part of the setup that is known, as NAME=X,Y,Z[,ROLL,PITCH,YAW] [m, rad]: tracker (the pose of the "
            "base in the tracker's frame), tool, marker_1. Repeatable.",
            show_default=False,
        ),
    ] = None,
    offset: Annotated[
        bool, typer.Option("--offset", help="Distances: estimate the zero of the instrument, too (draw wires).")
    ] = False,
    board: Annotated[
        str | None,
        typer.Option(
            "--board", help="Camera: corners across, corners along, spacing [m] of the board.", show_default=False
        ),
    ] = None,
    camera: Annotated[
        str | None, typer.Option("--camera", help="Camera: FX,FY,CX,CY [px], without distortion.", show_default=False)
    ] = None,
    camera_stands: Annotated[
        bool, typer.Option("--camera-stands", help="The camera stands, and the board is on the flange.")
    ] = False,
    model: Annotated[
        Path | None,
        typer.Option(
            "--model",
            help="A model.json of the robot: its torque of gravity bends the joints, not that of the description.",
            show_default=False,
        ),
    ] = None,
    check: Annotated[
        bool, typer.Option(help="Refuse poses in other units, orders or frames than stated, and lost markers.")
    ] = True,
    diagnosis: Annotated[bool, typer.Option(help="Look for the causes of the errors.")] = True,
    seed: SeedOption = 0,
    out: OutOption = Path("calibrated"),
    tip: TipOption = None,
    joints: JointsOption = None,
    lock: LockOption = None,
    assume_masses: AssumeMassesOption = None,
    png: PngOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Calibrates a robot's geometry from measured poses: joint zeros, links, base and tool.

    Writes calibration.json, report.html, the corrected robot as robot.urdf, robot.xml and robot.yaml, both
    Denavit-Hartenberg tables, and joint_zeros.yaml.
    """
    console = Console(json=json, quiet=quiet)
    with console.working() as progress:
        from estimation.calibrations import CalibrationOptions, read_poses
        from estimation.calibrations import calibrate as run
        from oed.reports import save_calibration_report
        from robots.common.files import ResultFolder

        options = _table_options(lengths, angles, quaternion, offset, board, camera, camera_stands, known)
        chosen = None if kinds is None else tuple(word.strip() for word in kinds.split(",") if word.strip())
        how = CalibrationOptions(kinds=chosen, diagnose=diagnosis, seed=seed)
        with ResultFolder(out, force, names=FILES) as folder:
            described = robot_from(robot, tip, joints, lock, assume_masses=assume_masses)
            arms = [described] if second is None else [described, robot_from(second)]
            measured = read_poses(poses, arms, options=options, checked=check)
            other = None if held_out is None else read_poses(held_out, arms, options=options, checked=check)
            if model is not None:
                measured, other = _with_model(measured, model), None if other is None else _with_model(other, model)
            result = run(arms, measured, held_out=other, options=how, progress=progress)
            result.save(folder.path("calibration.json").parent)
            _write_robot(result, folder)
            save_calibration_report(result, folder, png=png)
    data = result.to_dict()
    for long in ("poses", "robot", "corrected"):
        data.pop(long, None)
    console.result(f"{result.summary()}\nwritten to {out.resolve()}", data)


def _write_robot(result: Any, folder: Any) -> None:
    from estimation.calibrations.exports import (
        calibrated_mjcf,
        calibrated_urdf,
        calibrated_yaml,
        dh_text,
        zeros_text,
    )

    texts = {
        "robot.urdf": calibrated_urdf(result),
        "robot.xml": calibrated_mjcf(result),
        "robot.yaml": calibrated_yaml(result, "robot.urdf"),
        "dh_modified.csv": dh_text(result, "modified"),
        "dh_standard.csv": dh_text(result, "standard"),
        "joint_zeros.yaml": zeros_text(result),
    }
    for name, text in texts.items():
        if text is not None:
            folder.path(name).write_text(text, encoding="utf-8")


def _table_options(
    lengths: str,
    angles: str,
    quaternion: str,
    offset: bool,
    board: str | None,
    camera: str | None,
    stands: bool,
    known: list[str] | None,
) -> TableOptions:
    from estimation.calibrations import TableOptions
    from robots.common.errors import InputError

    corners, intrinsics = numbers("--board", board), numbers("--camera", camera)
    if corners is not None and (len(corners) != 3 or corners[0] != int(corners[0]) or corners[1] != int(corners[1])):
        raise InputError(f"--board {board}", allowed="ACROSS,ALONG,SPACING, such as 8,6,0.025")
    if intrinsics is not None and len(intrinsics) != 4:
        raise InputError(f"--camera {camera}", allowed="FX,FY,CX,CY [px]")
    parts = {}
    for text in known or []:
        name, _, values = text.partition("=")
        parts[name.strip()] = _part(text, numbers("--known", values or "none") or [])
    return TableOptions(
        lengths=lengths,
        angles=angles,
        quaternion=quaternion,
        offset=offset,
        board=None if corners is None else (int(corners[0]), int(corners[1]), corners[2]),
        intrinsics=None if intrinsics is None else (intrinsics[0], intrinsics[1], intrinsics[2], intrinsics[3]),
        camera_on_flange=not stands,
        known=parts,
    )


def _part(text: str, values: list[float]) -> NDArray[Any]:
    """A point of three numbers, or a pose of six."""
    import numpy as np

    from robots.common.errors import InputError
    from robots.geometry.chain import homogeneous, rotation_from_rpy

    if len(values) not in (3, 6) or not np.isfinite(values).all():
        raise InputError(f"--known {text}", allowed="NAME=X,Y,Z of a point, or NAME=X,Y,Z,ROLL,PITCH,YAW of a pose")
    return np.array(values) if len(values) == 3 else homogeneous(rotation_from_rpy(values[3:]), values[:3])


def _with_model(poses: MeasuredPoses, path: Path) -> MeasuredPoses:
    """The poses with the torque of gravity of an identified model."""
    from dataclasses import replace

    import numpy as np

    from estimation import load_model
    from robots.common.errors import InputError

    model = load_model(path)
    if model.robot.n != poses.q.shape[1]:
        raise InputError(f"a model of {model.robot.n} joints", file=path, allowed=str(poses.q.shape[1]))
    still = np.zeros_like(poses.q)
    return replace(poses, torque=-np.asarray(model.torque(poses.q, still, still)))
