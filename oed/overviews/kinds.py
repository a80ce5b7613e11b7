"""What the files of each kind of result say: verdict, how urgent it is, and key figures."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from estimation.actuators import LoopDiagnosis
from estimation.actuators.result import actuators_of
from estimation.calibrations.result import SHOWN, Calibration
from estimation.comparisons import DriveComparison
from estimation.diagnosis.results.standing import standing_of, standing_verdict
from estimation.payloads.body import body_from_dict
from estimation.payloads.result import PayloadEstimate
from oed.experiments.drives.result import DriveDesign
from oed.experiments.pose_designs.result import PoseDesign
from oed.experiments.quality import excitation_code
from oed.experiments.safety_checks.freedom import collides, freedom_text
from robots.common.records import Result, effect_code
from robots.terms.effects import EFFECTS

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
        return BY_NAME[name](data)
    if not isinstance(form, str) or not form.startswith("robot-oed "):
        return None
    if form in BY_FORMAT:
        return BY_FORMAT[form](data)
    return Reading(
        kind=form.removeprefix("robot-oed "), verdict="No summary of this kind of file.", codes=(), robot=_robot(data)
    )


def _design(data: Data) -> Reading:
    margins = data["smallest_margins"]
    whole = data["quality"][-1]
    beyond = [m for m in margins if m["slack_fraction"] < 0.0]
    tightest = min((m["slack_fraction"] for m in margins if m["limit"] is not None), default=None)
    cond = whole["cond_Y"]
    excitation = excitation_code(cond, whole["samples"])
    freedom = data.get("collision")
    codes = ["limit.exceeded"] if beyond else []
    codes += ["collision.unchecked"] if freedom is None else ["collision.found"] if collides(freedom) else []
    codes += [excitation] if excitation else []
    codes += ["value.assumed"] if data["assumed"] else []
    retimed = data.get("retiming")
    if beyond:
        verdict = f"Do not play this motion: it exceeds {len(beyond)} limits."
    elif freedom is None or collides(freedom):
        verdict = f"Do not play this motion. {freedom_text(freedom)}"
    elif retimed:
        verdict = retimed["verdict"]
    elif excitation:
        verdict = "This motion does not determine all parameters."
    else:
        verdict = f"Determines {len(data['model']['columns'])} base parameters within all limits."
    figures = {
        "cond(Y)": cond,
        "duration [s]": data["duration"],
        "tightest limit [% left]": None if tightest is None else 100.0 * tightest,
    }
    kind = "retimed path" if retimed else "design"
    return Reading(kind=kind, verdict=verdict, codes=tuple(codes) or ("done",), figures=figures, robot=_robot(data))


def _discrimination(data: Data) -> Reading:
    rivals = " or ".join(f"{r['effect'].replace('_', ' ')} of joint {r['joint']}" for r in data["rivals"])
    return Reading(
        kind="separating experiment",
        verdict=f"Separates {rivals}.",
        figures={"probability to name the cause [%]": 100.0 * data["resolves"]},
        robot=_robot(data),
    )


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


def _diagnosis(data: Data) -> Reading:
    verdict, findings = data["verdict"], data["findings"]
    text = {
        "none": "No missing effect was found",
        "named": "Found",
        "ambiguous": "Several causes fit",
        "unexplained": "Part of the residual has no known cause",
    }[verdict]
    known = [effect_code(f["effect"]) for f in findings if f["effect"] in EFFECTS]
    before, after = ([math.nan if x is None else x for x in data[part]["nrmse"]] for part in ("baseline", "extended"))
    standing, forbidden = standing_of(verdict, before, after), standing_verdict(verdict, before, after)
    codes = [*(known if standing != "unconfirmed" else []), *([f"diagnosis.{standing}"] if standing != "sound" else [])]
    codes += [f"diagnosis.{verdict}"] if verdict in ("ambiguous", "unexplained") else []
    places = [f["effect"].replace("_", " ") + (f" of joint {f['joint']}" if f["joint"] else "") for f in findings]
    return Reading(
        kind="diagnosis",
        verdict=f"{text}{': ' if places else ''}{', '.join(places)}. {forbidden}".rstrip(),
        codes=tuple(codes) or ("done",),
        figures={
            "effects found": len(findings),
            "NRMSE, base model [%]": _pooled(data["baseline"]["nrmse"]),
            "NRMSE, held-out data [%]": _pooled(data["extended"]["nrmse"]),
            # The share of a residual that has names does not describe the unexplained rest.
            "explained [%]": None
            if verdict == "unexplained" or data.get("explained") is None
            else 100.0 * data["explained"],
        },
        robot=_robot(data),
    )


def _thermal(data: Data) -> Reading:
    figures = {"log likelihood": data["log_likelihood"], "BIC": data["bic"], "rows": data["rows"]}
    open_ = sum(not p.get("determined", True) for p in data["parameters"])
    return Reading(
        kind="thermal model",
        verdict=f"{len(data['parameters'])} parameters, {open_} not determined. {data['status']}.".replace("..", "."),
        codes=("thermal.undetermined",) if open_ or not data["success"] else ("done",),
        figures=figures,
    )


def _monitoring(data: Data) -> Reading:
    return Reading(
        kind="monitoring",
        verdict=data["verdict"],
        codes=(*(f"change.{f['severity']}" for f in data["findings"]), "done"),
        figures={"changes": len(data["findings"]), "hours": data["hours"]},
        robot=_robot(data),
    )


def _state(data: Data) -> Reading:
    return Reading(kind="state of a monitor", verdict="The monitor continues from here.", codes=(), robot=_robot(data))


def _fleet(data: Data) -> Reading:
    counts = data["counts"]
    return Reading(
        kind="fleet",
        verdict=data["verdict"],
        codes=(f"fleet.{data['light']}",),
        figures={"robots": len(data["robots"]), **{f"robots, {light}": count for light, count in counts.items()}},
    )


def _comparison(data: Data) -> Reading:
    different = sum(bool(item["significant"]) for item in data["differences"])
    return Reading(
        kind="comparison",
        verdict=data["verdict"],
        codes=("difference",) if different else ("done",),
        figures={"models": len(data["runs"]), "significant differences": different},
        robot=_robot(data),
    )


def _payload(data: Data) -> Reading:
    result = PayloadEstimate.from_dict(data, body=body_from_dict(dict(data), PayloadEstimate.FILE))
    return _said("payload", result, data, {"mass [kg]": data["mass"], "rows": result.rows})


def _drives(data: Data) -> Reading:
    result = actuators_of(data)
    figures = {"effects": len(result.findings), "parameters": len(result.parameters)}
    return _said("drives", result, data, {"error [mrad]": 1e3 * result.held_out_error, **figures})


def _loop_diagnosis(data: Data) -> Reading:
    result = LoopDiagnosis.from_dict(data)
    mean = sum(error.held_out for error in result.errors) / max(len(result.errors), 1)
    figures = {"error [mrad]": 1e3 * mean, "effects": len(result.findings)}
    return _said("diagnosis in the loop", result, data, figures)


def _drive_comparison(data: Data) -> Reading:
    result = DriveComparison.from_dict(data)
    figures = {"runs": len(result.runs), "significant differences": len(result.different)}
    return _said("comparison of drives", result, data, figures)


def _calibration(data: Data) -> Reading:
    result = Calibration.from_dict(data, robot=None, corrected=None)
    unit, factor = SHOWN[result.unit]
    errors = {f"before [{unit}]": factor * result.levels.before, f"held out [{unit}]": factor * result.levels.held_out}
    return _said("calibration", result, data, {**errors, "outliers": len(result.outliers)})


def _drive_design(data: Data) -> Reading:
    result = DriveDesign.from_dict(data, t=None, command=None)
    return _said("motion for drives", result, data, {"parameters": len(result.expected)})


def _pose_design(data: Data) -> Reading:
    result = PoseDesign.from_dict(data, robot=None, motion=None, parameters=(), expected=None)
    poses: dict[str, Figure] = {"poses": len(result.q), "O1": data["observability"]["O1"]}
    return _said("poses", result, data, {**poses, "duration [s]": data["duration"]})


def _forces(data: Data) -> Reading:
    count = len(data["contacts"])
    return Reading(
        kind="forces",
        verdict=f"{count or 'No'} contact{'' if count == 1 else 's'} in {data['duration']:.0f} s.",
        codes=("contact",) if count else ("done",),
        figures={"contacts": count, "duration [s]": data["duration"]},
        robot=_robot(data),
    )


def _campaign(data: Data) -> Reading:
    return Reading(
        kind="campaign",
        verdict=f"{len(data['stages'])} stages, {data['cycles']} cycles, {data['duration'] / 3600.0:.1f} h.",
        codes=("experiment.note",) if data["notes"] else ("done",),
        figures={"duration [s]": data["duration"], "stages": len(data["stages"]), "cycles": data["cycles"]},
        robot=_robot(data),
    )


def _pareto(data: Data) -> Reading:
    points = data["points"]
    return Reading(
        kind="pareto front",
        verdict=f"{sum(point['efficient'] for point in points)} of {len(points)} designs are not dominated.",
        figures={"designs": len(points)},
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


def _said(kind: str, result: Result, data: Data, figures: Mapping[str, Figure]) -> Reading:
    """What a result says of itself."""
    return Reading(
        kind=kind,
        verdict=result.conclusion,
        codes=(*(remark.code for remark in result.remarks), "done"),
        figures=figures,
        robot=_robot(data),
    )


def _robot(data: Data) -> str:
    robot = data.get("robot", "")
    return str(robot.get("name", "") if isinstance(robot, Mapping) else robot or "")


def _pooled(errors: Sequence[float | None]) -> float | None:
    """Root mean square over the joints [%]."""
    known = [float(error) for error in errors if error is not None]
    return 100.0 * math.sqrt(sum(error**2 for error in known) / len(known)) if known else None


BY_FORMAT: dict[str, Callable[[Data], Reading]] = {
    "robot-oed design": _design,
    "robot-oed discriminating experiment": _discrimination,
    "robot-oed model": _model,
    "robot-oed thermal model": _thermal,
    "robot-oed monitoring": _monitoring,
    "robot-oed monitor": _state,
    "robot-oed fleet": _fleet,
    "robot-oed comparison": _comparison,
    "robot-oed actuators": _drives,
    "robot-oed loop diagnosis": _loop_diagnosis,
    "robot-oed drive comparison": _drive_comparison,
    "robot-oed drive design": _drive_design,
    "robot-oed payload": _payload,
    "robot-oed calibration": _calibration,
    "robot-oed pose design": _pose_design,
    "robot-oed forces": _forces,
    "robot-oed campaign": _campaign,
    "robot-oed pareto front": _pareto,
}
BY_NAME: dict[str, Callable[[Data], Reading]] = {"diagnosis.json": _diagnosis, "limits.json": _limits}
"""Results whose file does not state its format."""
