"""A design as `design.json`, and back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from oed.criteria import Criterion
from oed.criteria import criterion as choose_criterion
from oed.experiments.problems.essential import restricted
from oed.experiments.quality import design_model
from oed.exports import read_trajectory
from robots.base_parameters import find_base_parameters
from robots.common.errors import InputError
from robots.common.records import damage_refused, read_json
from robots.loading import load_robot
from robots.robot import Robot
from robots.terms.situations.flange_body import carrying, payload_part

TRAJECTORY, DESIGN = "trajectory.csv", "design.json"


def read_design(
    folder: str | Path, robot: Robot | None = None, criterion: str | Criterion | None = None
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Reads the file of a saved design, and the attributes that it holds in another form.

    Args:
        folder: where `save` wrote.
        robot: the robot; by default the one that the design names. One that was made in memory, or of chosen
            joints of a URDF, must be given.
        criterion: what was optimised, if it was a criterion of one's own.

    Raises:
        InputError: a missing or damaged file, or another robot than the design's.
    """
    file, remedy = Path(folder) / DESIGN, "give the folder written by `oed design`"
    data = read_json(file, "robot-oed design", remedy=remedy)
    with damage_refused(file, remedy=remedy):
        settings = data["settings"]
        known = carrying(robot or load_robot(data["robot"]["origin"], unlimited=True), settings.get("payload"))
        model = design_model(known, settings)
        base = payload_part(model) if settings.get("payload_only") else find_base_parameters(model)
        if settings.get("essential"):
            base = restricted(base, [i for i, name in enumerate(base.names) if name in data["model"]["columns"]])
        if list(base.names) != data["model"]["columns"]:
            raise InputError(f"the design is for {data['robot']['name']}, not for {known.name}", file=file)
        motion = read_trajectory(Path(folder) / TRAJECTORY)[0]
        return data | {"home": data.get("home", motion.q[0].tolist())}, {
            "robot": known,
            "base": base,
            "criterion": choose_criterion(criterion or data["criterion"]),
            "motion": motion,
            "coefficients": np.array((data.get("fourier") or data["excitation"])["coefficients"]),
        }
