"""Which effects a planned experiment could show, and from which size on."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from estimation import Model
from estimation.diagnosis.experiment_plans.detection_limits import Limit
from estimation.diagnosis.experiment_plans.planned_limits import planned_limits
from robots.common.files import write_atomic
from robots.common.progress import SILENT, Progress
from robots.common.records import Record
from robots.plants import Sensors
from robots.regressor import default_model
from robots.robot import Robot
from robots.signals import Motion


@dataclass(frozen=True, kw_only=True)
class DetectionLimits(Record):
    """Effects that planned motions could show.

    Attributes:
        robot: its name.
        limits: one per effect and joint.
        beyond: extensions of the model, without which the limits are computed.
        notes: what makes the limits unsure, in sentences.
    """

    ENTRIES = ("robot", "limits", "extensions_not_counted=beyond", "notes")

    robot: str
    limits: tuple[Limit, ...]
    beyond: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def summary(self) -> str:
        """Writes the limits as a table."""
        hidden = sum(not np.isfinite(limit.detectable) for limit in self.limits)
        # Size at which effects are counted as named, over the joint's torque RMS.
        named = sum(limit.attributable <= 0.02 for limit in self.limits)
        lines = [
            f"{len(self.limits)} pairs of effect and joint: {named} would be found and named at 2 % of the joint's "
            f"torque RMS, {hidden} cannot be found with this motion at any size",
            "  found: smallest effect, in % of the joint's torque RMS, that is found with 95 % probability",
            "  worst case: the same for the least visible shape; named: also distinguished from other effects",
            f"  {'effect':28} {'joint':>5} {'found [%]':>11} {'worst case':>10} {'named [%]':>11}   closest rival",
        ]
        lines += [
            f"  {limit.effect:28} {limit.joint or 'all':>5} {_percent(limit.detectable):>11} "
            f"{_percent(limit.at_worst):>10} {_percent(limit.attributable):>11}   {limit.toughest or ''}".rstrip()
            for limit in self.limits
        ]
        lines += [f"  {note}" for note in self.notes]
        if self.beyond:
            lines.append(f"  these limits refer to the base model without its extensions: {', '.join(self.beyond)}")
        return "\n".join(lines)

    def save(self, folder: str | PathLike[str]) -> None:
        """Writes limits.json into a folder.

        Args:
            folder: that exists.
        """
        write_atomic(Path(folder) / "limits.json", json.dumps(self.to_dict(), indent=2, allow_nan=False) + "\n")


def detection_limits(
    robot: Robot,
    motions: Sequence[Motion],
    *,
    model: Model | None = None,
    noise: float = 0.02,
    progress: Progress | None = None,
) -> DetectionLimits:
    """Computes which effects planned motions could show, and from which size on.

    Args:
        robot: the robot.
        motions: what is planned; they follow one another.
        model: identified before; by default the robot's nominal dynamics.
        noise: expected torque noise over the torque RMS.
        progress: hears how far it is.

    Returns:
        The limits.

    Raises:
        InputError: see `planned_limits`.
    """
    beyond, notes = [], []
    if model is None:
        # The model that a diagnosis fits by default.
        torque_model = default_model(robot, friction="polynomial", velocity_scale=1e-3)
        parameters = np.asarray(torque_model.nominal)
        smooth = [joint for joint, friction in enumerate(np.asarray(robot.friction), 1) if not friction.any()]
        notes = [_SMOOTH.format(", ".join(map(str, smooth)))] if smooth else []
    else:
        torque_model = model.torque_model
        parameters = np.zeros(torque_model.size)
        parameters[list(model.columns)] = model.values
        beyond = [e.effect if e.joint is None else f"{e.effect} of joint {e.joint}" for e in model.extensions]
    placed: list[Motion] = []
    for motion in motions:
        # A second passes between two motions on one clock.
        start = float(placed[-1].t[-1]) + 1.0 if placed else 0.0
        placed.append(Motion(motion.t - motion.t[0] + start, motion.q, motion.dq, motion.ddq))
    (progress or SILENT).start("all effects, all joints", None)
    found = planned_limits(torque_model, parameters, placed, noise=Sensors(torque_noise=max(noise, 1e-4)))
    return DetectionLimits(robot=robot.name, limits=found, beyond=tuple(beyond), notes=tuple(notes))


_SMOOTH = (
    "The robot's description states no friction for joints {}. The limits refer to a torque without it and may be "
    "far too small. Use --model with an identified model."
)


def _percent(share: float) -> str:
    return f"{100 * share:.2g}" if share < float("inf") else "-"
