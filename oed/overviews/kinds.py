"""What the files of each kind of result say: verdict, how urgent it is, and key figures.

Results state their conclusion and remarks in their files. What is here is which figures a table of many results shows.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from estimation.calibrations.result import SHOWN

Figure = float | str | None
Data = Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class Reading:
    """What one file says.

    Attributes:
        kind: in words.
        verdict: in one sentence.
        codes: keys of `severity.LEVELS`; empty for a result without a judgement.
        figures: by their labels with units.
        robot: its name; empty where the file states none.
    """

    kind: str
    verdict: str
    codes: tuple[str, ...] = ("done",)
    figures: Mapping[str, Figure] = field(default_factory=dict)
    robot: str = ""


def read_kind(name: str, data: Data) -> Reading | None:
    """Reads a result.

    Args:
        name: of the file.
        data: its content.

    Returns:
        What it says; None of a file that is not of this program.

    Raises:
        KeyError: a key that this version needs is missing.
        TypeError: a value of another type.
        ValueError: a value that makes no sense.
    """
    form = data.get("format")
    if form is None and name in BY_NAME:
        form = name
    elif not isinstance(form, str) or not form.startswith("robot-oed "):
        return None
    if form in PARTS:
        return PARTS[form](data)
    kind, figures = RESULTS.get(form, (form.removeprefix("robot-oed "), None))
    if figures is None:
        return Reading(kind=kind, verdict="No summary of this kind of file.", codes=(), robot=_robot(data))
    codes = (*(remark["code"] for remark in data["remarks"]), "done")
    if "retiming" in data:
        kind = "retimed path"
    return Reading(kind=kind, verdict=data["conclusion"], codes=codes, figures=figures(data), robot=_robot(data))


def _model(data: Data) -> Reading:
    parameters, provenance = data["parameters"], data["provenance"]
    undetermined = sum(not p.get("determined", True) for p in parameters)
    extensions = [e["effect"] for e in data.get("extensions", ())]
    verdict = f"{len(parameters)} parameters, {undetermined} not determined"
    if extensions:
        verdict += f"; extended by {', '.join(dict.fromkeys(e.replace('_', ' ') for e in extensions))}"
    figures: dict[str, Figure] = {
        "parameters": len(parameters),
        "not determined": undetermined,
        "logs": len(provenance.get("logs", ())),
        "rows": sum(log.get("samples", 0) for log in provenance.get("logs", ())) or None,
        "method": provenance.get("method"),
    }
    errors = provenance.get("unseen_nrmse")
    if isinstance(errors, Sequence):
        figures["NRMSE, held-out data [%]"] = _pooled(errors)
    return Reading(
        kind="model",
        verdict=f"{verdict}.",
        codes=("parameters.undetermined",) if undetermined else ("done",),
        figures=figures,
        robot=_robot(data),
    )


def _limits(data: Data) -> Reading:
    limits = data["limits"]
    hidden = sum(limit["detectable"] is None for limit in limits)
    return Reading(
        kind="detection limits",
        verdict=f"{hidden} of {len(limits)} effects cannot be found with this motion.",
        codes=("detection.limited",) if hidden else ("done",),
        figures={"effects": len(limits), "cannot be found": hidden},
        robot=_robot(data),
    )


def _state(data: Data) -> Reading:
    return Reading(kind="state of a monitor", verdict="The monitor continues from here.", codes=(), robot=_robot(data))


def _of_design(data: Data) -> dict[str, Figure]:
    tightest = min((m["slack_fraction"] for m in data["smallest_margins"] if m["limit"] is not None), default=None)
    return {
        "cond(Y)": data["quality"][-1]["cond_Y"],
        "duration [s]": data["duration"],
        "tightest limit [% left]": None if tightest is None else 100.0 * tightest,
    }


def _of_diagnosis(data: Data) -> dict[str, Figure]:
    # The share of a residual that has names does not describe the unexplained rest.
    explained = None if data["verdict"] == "unexplained" else data.get("explained")
    return {
        "effects found": len(data["findings"]),
        "NRMSE, base model [%]": _pooled(data["baseline"]["nrmse"]),
        "NRMSE, held-out data [%]": _pooled(data["extended"]["nrmse"]),
        "explained [%]": None if explained is None else 100.0 * explained,
    }


def _of_calibration(data: Data) -> dict[str, Figure]:
    unit, factor = SHOWN[data["unit"]]
    errors = data["levels"]
    return {
        f"before [{unit}]": factor * errors["before"],
        f"held out [{unit}]": factor * errors["held_out"],
        "outliers": len(data["outliers"]),
    }


def _robot(data: Data) -> str:
    robot = data.get("robot", "")
    return str(robot.get("name", "") if isinstance(robot, Mapping) else robot or "")


def _pooled(errors: Sequence[float | None]) -> float | None:
    """Root mean square over the joints [%]."""
    known = [float(error) for error in errors if error is not None]
    return 100.0 * math.sqrt(sum(error**2 for error in known) / len(known)) if known else None


RESULTS: dict[str, tuple[str, Callable[[Data], Mapping[str, Figure]]]] = {
    "diagnosis.json": ("diagnosis", _of_diagnosis),
    "robot-oed design": ("design", _of_design),
    "robot-oed discriminating experiment": (
        "separating experiment",
        lambda data: {"probability to name the cause [%]": 100.0 * data["resolves"]},
    ),
    "robot-oed thermal model": (
        "thermal model",
        lambda data: {"log likelihood": data["log_likelihood"], "BIC": data["bic"], "rows": data["rows"]},
    ),
    "robot-oed monitoring": ("monitoring", lambda data: {"changes": len(data["findings"]), "hours": data["hours"]}),
    "robot-oed fleet": (
        "fleet",
        lambda data: {"robots": len(data["robots"])} | {f"robots, {k}": count for k, count in data["counts"].items()},
    ),
    "robot-oed comparison": (
        "comparison",
        lambda data: {
            "models": len(data["runs"]),
            "significant differences": sum(bool(item["significant"]) for item in data["differences"]),
        },
    ),
    "robot-oed actuators": (
        "drives",
        lambda data: {
            "error [mrad]": 1e3 * sum(joint["held_out"] for joint in data["errors"]) / len(data["errors"]),
            "effects": len(data["findings"]),
            "parameters": len(data["parameters"]),
        },
    ),
    "robot-oed loop diagnosis": (
        "diagnosis in the loop",
        lambda data: {
            "error [mrad]": 1e3 * sum(joint["held_out"] for joint in data["errors"]) / max(len(data["errors"]), 1),
            "effects": len(data["findings"]),
        },
    ),
    "robot-oed drive comparison": (
        "comparison of drives",
        lambda data: {
            "runs": len(data["runs"]),
            "significant differences": sum(bool(item["differs"]) for item in data["differences"]),
        },
    ),
    "robot-oed drive design": ("motion for drives", lambda data: {"parameters": len(data["expected"])}),
    "robot-oed payload": ("payload", lambda data: {"mass [kg]": data["mass"], "rows": data["rows"]}),
    "robot-oed calibration": ("calibration", _of_calibration),
    "robot-oed pose design": (
        "poses",
        lambda data: {"poses": len(data["poses"]), "O1": data["observability"]["O1"], "duration [s]": data["duration"]},
    ),
    "robot-oed forces": (
        "forces",
        lambda data: {"contacts": len(data["contacts"]), "duration [s]": data["duration"]},
    ),
    "robot-oed campaign": (
        "campaign",
        lambda data: {"duration [s]": data["duration"], "stages": len(data["stages"]), "cycles": data["cycles"]},
    ),
    "robot-oed pareto front": ("pareto front", lambda data: {"designs": len(data["points"])}),
}
"""What a result is called, and its figures, by its format; of a file without one by its name."""

PARTS: dict[str, Callable[[Data], Reading]] = {
    "robot-oed model": _model,
    "robot-oed monitor": _state,
    "limits.json": _limits,
}
"""Files that are no result by themselves, and so have no conclusion."""

BY_NAME = ("diagnosis.json", "limits.json")
"""Results whose file does not state its format."""
