"""The excitation stage: a saved design, a design in memory, or a quick one made on the spot."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from oed.campaigns.stages import Stage
from oed.experiments.results.design_file import DESIGN, TRAJECTORY
from oed.experiments.results.result import Design
from oed.exports import read_trajectory
from robots.common.errors import InputError
from robots.common.records import damage_refused, read_json
from robots.robot import Robot


def excitation_stage(robot: Robot, design: Design | str | PathLike[str]) -> tuple[Stage, tuple[str, ...]]:
    """Takes the motion of a design.

    Args:
        robot: what the campaign is for.
        design: the design, or the folder that `Design.save` wrote.

    Returns:
        The stage, not yet checked, and notes about it.

    Raises:
        InputError: a missing or damaged file, or a design for another robot or another sample period.
    """
    if isinstance(design, Design):
        data, motion, file = design.to_dict(), design.motion, None
    else:
        file = Path(design) / DESIGN
        remedy = "give the folder written by `oed design`"
        data = read_json(file, "robot-oed design", remedy=remedy)
        with damage_refused(file, remedy=remedy):
            _ = data["robot"]["name"], data["robot"]["sha256"], data["segments"], data["quality"], data["criterion"]
        motion, _ = read_trajectory(Path(design) / TRAJECTORY)
    known = data["robot"]
    if known["name"] != robot.name or motion.n != robot.n:
        raise InputError(
            f"the design is for {known['name']}, not for {robot.name}",
            file=file,
            remedy=f"oed design --robot {robot.stated or robot.name}",
        )
    if motion.period is None or abs(motion.period - robot.period) > 1e-9:
        raise InputError(f"the design's samples are {motion.period} s apart", file=file, allowed=f"{robot.period} s")
    notes = []
    if known["sha256"] != robot.digest:
        notes.append(
            f"The excitation was designed for another description of {robot.name}. Its limits were checked with the "
            f"present one; its criterion was not recomputed."
        )
    return (
        Stage(
            name="excitation",
            kind="excitation",
            motion=motion,
            segments=tuple(data["segments"]),
            details={"criterion": data["criterion"], "quality": [_brief(quality) for quality in data["quality"]]},
        ),
        tuple(notes),
    )


def _brief(quality: dict[str, object]) -> dict[str, object]:
    return {key: value for key, value in quality.items() if key != "singular_values_Y"}
