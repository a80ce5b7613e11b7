"""The one loader of saved results: it looks what kind of result a file holds, and reads it back."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from os import PathLike
from pathlib import Path
from typing import Any

from robots.common.errors import InputError
from robots.common.records import read_json

FILES = (
    *("diagnosis.json", "calibration.json", "actuators.json", "payload.json", "thermal.json", "forces.json"),
    *("monitor.json", "fleet.json", "campaign.json", "compare.json", "pareto.json", "design.json", "model.json"),
)
"""Files of a folder in the order in which one is taken: a model beside another result is part of it."""

LOADERS = {
    "robot-oed actuators": "estimation.actuators.result.load_actuators",
    "robot-oed calibration": "estimation.calibrations.result.load_calibration",
    "robot-oed campaign": "oed.campaigns.result.Campaign.load",
    "robot-oed design": "oed.experiments.results.result.Design.load",
    "robot-oed drive design": "oed.experiments.drives.result.DriveDesign.load",
    "robot-oed fleet": "estimation.monitoring.fleets.result.FleetResult.load",
    "robot-oed forces": "estimation.external_forces.result.ForceEstimate.load",
    "robot-oed model": "estimation.models.model.load_model",
    "robot-oed monitor": "estimation.monitoring.monitor.Monitor.load",
    "robot-oed monitoring": "estimation.monitoring.result.MonitorResult.load",
    "robot-oed payload": "estimation.payloads.result.load_payload",
    "robot-oed pose design": "oed.experiments.pose_designs.result.load_pose_design",
    "robot-oed thermal model": "estimation.thermal.results.estimate.load_thermal_model",
}
"""Which function reads which format."""

ELSEWHERE = {
    "robot-oed loop diagnosis": "load the actuators.json beside it, and call estimation.actuators.loop_diagnosis again",
    "robot-oed drive comparison": "load the results of oed actuators, and call compare_drives again",
    "robot-oed comparison": "its models are not in it; load them, and call estimation.compare again",
    "robot-oed discriminating experiment": "read its trajectory.csv by oed.read_trajectory",
    "robot-oed pareto front": "load one of the designs in its sub-folders",
}
"""What to do about results whose files hold figures only."""

REMEDY = "give a result of oed: its folder, or its JSON file"


def load(path: str | PathLike[str]) -> Any:
    """Reads a saved result back, whichever command or `save` wrote it.

    Args:
        path: its folder, or its JSON file.

    Returns:
        What the function gave that made it, as far as its files hold it: a `Design`, `Campaign`, `Diagnosis` ...; of an
        identification its `Model`, of `oed monitor --state` the `Monitor`.

    Raises:
        InputError: no such file, no result, a damaged one, or one of a newer version; file and entry are named.
    """
    file = Path(path)
    if file.is_dir():
        found = next((name for name in FILES if (file / name).is_file()), None)
        if found is None:
            raise InputError("holds no result", file=file, allowed=", ".join(FILES), remedy=REMEDY)
        file = file / found
    data = read_json(file, remedy=REMEDY)
    form = str(data.get("format"))
    if file.name == "diagnosis.json" and form not in ELSEWHERE:
        return _named("estimation.diagnosis.Diagnosis.load")(file.parent)
    if form in ELSEWHERE:
        raise InputError(f"is a {form.removeprefix('robot-oed ')}", file=file, remedy=ELSEWHERE[form])
    if form not in LOADERS:
        raise InputError(f"found the format {form}", file=file, column="format", allowed=", ".join(LOADERS))
    if "retiming" in data:
        return _named("oed.experiments.results.retimed.RetimedExperiment.load")(file.parent)
    by_folder = LOADERS[form].endswith((".load", "load_pose_design")) and form != "robot-oed monitor"
    return _named(LOADERS[form])(file.parent if by_folder else file)


def _named(path: str) -> Callable[[Path], Any]:
    """The function of a path such as ``package.module.Class.load``."""
    parts = path.split(".")
    module = next(k for k, part in enumerate(parts) if part[0].isupper() or part.startswith("load_"))
    found: Any = import_module(".".join(parts[:module]))
    for part in parts[module:]:
        found = getattr(found, part)
    return found
