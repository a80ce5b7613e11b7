"""A design as `design.json`, and back."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from oed.criteria import Criterion
from oed.criteria import criterion as choose_criterion
from oed.experiments.essential import restricted
from oed.experiments.margins import margin_data, margin_from, missing_limits
from oed.experiments.quality import Quality, design_model
from oed.experiments.spatial_check import SpatialMargin
from oed.exports import read_trajectory
from robots.base_parameters import find_base_parameters
from robots.common.errors import InputError
from robots.common.files import existing_file
from robots.loading import load_robot
from robots.robot import Robot
from robots.version import VERSION

if TYPE_CHECKING:
    from oed.experiments.result import Design

TRAJECTORY, DESIGN = "trajectory.csv", "design.json"


def design_data(design: Design) -> dict[str, Any]:
    """Writes everything but the samples of a design as plain data for `design.json`."""
    model = design.base.model
    return {
        "format": "robot-oed design",
        "format_version": 1,
        "tool_version": VERSION,
        "robot": {"name": design.robot.name, "origin": design.robot.origin, "sha256": design.robot.digest},
        "assumed": [*design.robot.assumed, *(f"limits.{name}" for name in missing_limits(design.robot.limits))],
        "model": {
            "columns": list(design.base.names),
            "units": [column.unit for column in design.base.columns],
            "stands_for": list(design.base.formulas()),
            "terms": [term.name for term in model.terms],
            "scaling": design.settings.get("scaling", "none"),
            "coulomb": f"tanh(dq / {design.settings['velocity_scale']:g})",
        },
        "criterion": design.criterion.name,
        "criterion_label": design.criterion.label,
        "quality": [quality.to_dict() for quality in design.qualities],
        "fourier": {
            "base_frequency_hz": design.settings["base_frequency"],
            "harmonics": design.settings["harmonics"],
            "periods": design.settings["periods"],
            "coefficients": design.coefficients.tolist(),
        },
        "segments": [dict(segment) for segment in design.segments],
        "duration": design.motion.duration,
        "period": design.robot.period,
        "home": design.home.tolist(),
        "home_moved": design.home_moved,
        "limits_in_space": [asdict(margin) for margin in design.space],
        "collision": None if design.freedom is None else dict(design.freedom),
        "strokes_left_out": list(design.strokes_left_out),
        "smallest_margins": [margin_data(margin) for margin in design.margins],
        "solver": {
            "name": design.settings["solver"]["name"],
            "islands": [island.to_dict() for island in design.islands],
        },
        "seed": design.settings["seed"],
        "settings": dict(design.settings),
    }


def load_design(folder: str | Path, robot: Robot | None = None, criterion: str | Criterion | None = None) -> Design:
    """Reads a saved design.

    Args:
        folder: where `save` wrote.
        robot: the robot; by default the one that the design names. One that was made in memory, or of chosen
            joints of a URDF, must be given.
        criterion: what was optimised, if it was a criterion of one's own.

    Raises:
        InputError: a missing or damaged file, or another robot than the design's.
    """
    from oed.experiments.result import Design, Outcome

    file = Path(folder) / DESIGN
    try:
        data = json.loads(existing_file(file).read_text(encoding="utf-8"))
        known = robot or load_robot(data["robot"]["origin"])
        settings = data["settings"]
        base = find_base_parameters(design_model(known, settings))
        if settings.get("essential"):
            base = restricted(base, [i for i, name in enumerate(base.names) if name in data["model"]["columns"]])
        if list(base.names) != data["model"]["columns"]:
            raise InputError(f"the design is for {data['robot']['name']}, not for {known.name}", file=file)
        qualities = tuple(
            Quality(part=q["part"], samples=q["samples"], singular_values=tuple(q["singular_values_Y"]))
            for q in data["quality"]
        )
        margins = tuple(margin_from(margin) for margin in data["smallest_margins"])
        motion = read_trajectory(Path(folder) / TRAJECTORY)[0]
        return Design(
            robot=known,
            base=base,
            criterion=choose_criterion(criterion or data["criterion"]),
            motion=motion,
            segments=tuple(data["segments"]),
            qualities=qualities,
            margins=margins,
            islands=tuple(Outcome.from_dict(island) for island in data["solver"]["islands"]),
            settings=settings,
            coefficients=np.array(data["fourier"]["coefficients"]),
            home=np.array(data["home"]) if "home" in data else motion.q[0],
            home_moved=data.get("home_moved", False),
            space=tuple(SpatialMargin(**margin) for margin in data.get("limits_in_space", ())),
            freedom=data["collision"],
            strokes_left_out=tuple(data["strokes_left_out"]),
        )
    except (OSError, UnicodeDecodeError, json.JSONDecodeError, KeyError, TypeError) as error:
        raise InputError(f"is not a design file, or is damaged ({type(error).__name__}: {error})", file=file) from error
