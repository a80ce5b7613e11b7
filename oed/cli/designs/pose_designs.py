"""``oed design --for calibration``: poses to measure."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from oed.cli.options import numbers
from robots.common.errors import InputError
from robots.common.progress import Progress

if TYPE_CHECKING:
    from oed.experiments.pose_designs import View
    from robots.collision import Surroundings
    from robots.geometry_errors import Measurement
    from robots.robot import Robot

PosesOption = Annotated[int, typer.Option("--poses", min=1, help="Calibration: number of poses.")]
MeasurementOption = Annotated[
    str,
    typer.Option(
        "--measurement",
        help="Calibration: what is measured: markers, markers:N, poses, distances, distances:N or inclinometer.",
    ),
]
KindsOption = Annotated[
    str,
    typer.Option(
        "--kinds",
        help="Calibration: kinds of errors to determine, comma-separated: joint_zero, link_placement, gear_ratio, "
        "eccentricity, joint_compliance, link_compliance.",
    ),
]
ViewFromOption = Annotated[
    str | None,
    typer.Option(
        "--view-from", help="Calibration: where the instrument stands, X,Y,Z in the base frame [m].", show_default=False
    ),
]
ViewTowardsOption = Annotated[
    str | None,
    typer.Option(
        "--view-towards", help="Calibration: the point at which it looks, X,Y,Z in the base frame.", show_default=False
    ),
]
ViewConeOption = Annotated[
    float, typer.Option("--view-cone", help="Calibration: half-angle of its cone of view [deg].")
]
FacingOption = Annotated[
    str | None,
    typer.Option(
        "--facing",
        help="Calibration: direction of the flange in which markers face, X,Y,Z: they are seen within 60 deg of it.",
        show_default=False,
    ),
]


def design_calibration(
    robot: Robot,
    *,
    poses: int,
    criterion: str,
    measurement: str,
    kinds: str,
    view_from: str | None,
    view_towards: str | None,
    view_cone: float,
    facing: str | None,
    noise: list[float] | None,
    home: list[float] | None,
    velocity_fraction: float | None,
    collision: bool,
    clearance: float,
    surroundings: Surroundings,
    seed: int,
    out: Path,
    png: bool,
    force: bool,
    progress: Progress,
) -> tuple[str, dict[str, Any]]:
    """Writes poses.csv, trajectory.csv, design.json and report.html; returns the summary and the data."""
    from oed.experiments.pose_designs import PoseOptions, design_poses
    from oed.reports.pages.calibrations.pose_design_report import save_pose_design_report
    from robots.common.files import ResultFolder

    instrument = measurement_from(measurement)
    if noise is not None and len(noise) > len(set(instrument.units)):
        raise InputError(
            f"--noise with {len(noise)} numbers", allowed=f"one per unit: {', '.join(dict.fromkeys(instrument.units))}"
        )
    levels = dict(zip(dict.fromkeys(instrument.units), noise or (), strict=False))
    options = PoseOptions(
        measurement=instrument,
        kinds=tuple(word.strip() for word in kinds.split(",") if word.strip()),
        noise=levels,
        view=_view(view_from, view_towards, view_cone, facing),
        collision=collision,
        clearance=clearance,
        surroundings=surroundings,
        velocity_fraction=velocity_fraction,
        home=home,
        seed=seed,
    )
    names = ["poses.csv", "trajectory.csv", "design.json", "report.html"]
    with ResultFolder(out, force, names=names) as folder:
        result = design_poses(robot, count=poses, criterion=criterion, options=options, progress=progress)
        result.save(folder.path("design.json").parent)
        save_pose_design_report(result, folder, png=png)
    data = result.to_dict()
    for long in ("segments", "eigenvalues", "random_eigenvalues"):
        data.pop(long)
    return result.summary(), data


def measurement_from(text: str) -> Measurement:
    """Makes the measurement that an option names.

    Args:
        text: such as "markers:3".

    Raises:
        InputError: another name, or a number that is none.
    """
    from robots.geometry_errors import BodyPoses, Distances, Inclinometer, Markers

    name, _, number = text.partition(":")
    if number and not (number.isdigit() and int(number) > 0):
        raise InputError(f"--measurement {text}", allowed="a number of markers or anchors of 1 or more, as markers:3")
    count = int(number or 1)
    if name == "markers":
        return Markers(count=count)
    if name == "distances":
        return Distances(count=count)
    if name == "poses" and not number:
        return BodyPoses()
    if name == "inclinometer" and not number:
        return Inclinometer()
    raise InputError(
        f"--measurement {text}", allowed="markers, markers:N, poses, distances, distances:N or inclinometer"
    )


def _view(origin: str | None, towards: str | None, cone: float, facing: str | None) -> View | None:
    from oed.experiments.pose_designs import View

    place = numbers("--view-from", origin)
    if place is None:
        if towards is not None or facing is not None:
            raise InputError("--view-towards and --facing need --view-from", remedy="state where the instrument stands")
        return None
    return View(
        origin=place,
        towards=numbers("--view-towards", towards),
        cone=math.radians(cone),
        axis=numbers("--facing", facing),
    )
