"""What to do about a diagnosis: its verdict, and an action for each effect that it finds."""

from __future__ import annotations

from collections.abc import Iterable

from estimation.diagnosis.calibration import CLOSE_RIVAL_BIC
from estimation.diagnosis.experiment_plans.detection_limits import summarise_limits
from estimation.diagnosis.results.standing import standing_of, standing_text, standing_verdict
from oed.reports.pages.diagnosis_view import DiagnosisView, FindingView
from oed.reports.rendering.page import Finding, findings_of
from oed.reports.rendering.severity import FAULTS

MODEL = "Use the extended model (model.json) instead of the robot's description."

ACTIONS = {
    "backlash": "Inspect the gear of {place} for play.",
    "base_compliance": "Check the bolts of the base, its pedestal and the floor.",
    "base_tilt": "Level the base, or state its orientation (--gravity).",
    "current_clipping": "Check the drive's current limit at {place}; record with less acceleration.",
    "encoder_eccentricity": "Inspect the encoder mounting of {place}.",
    "encoder_offset": "Calibrate the zero position of {place} again.",
    "external_contact": "Check the cell for a collision with {place}.",
    "friction_step": "Inspect the drive of {place} (gear, lubricant, brake).",
    "payload_change": "Check tool and load. If the change is intended, state it (--payload).",
    "time_delay": "Check the time stamps of torque and position at {place}.",
    "torque_constant_error": "Check the torque constant of {place} in the drive's settings.",
    "torque_crosstalk": "Inspect the cables and the assignment of the torque signals of {place}.",
    "torque_sensor_drift": "Check the zero of the torque sensor of {place}.",
}
"""Sentences with the place left open, of each of `severity.FAULTS`."""


def place_of(joints: Iterable[int | None]) -> str:
    """Names joints in a sentence, such as "joints 4 and 5"; the robot where one of them is None.

    Args:
        joints: counted from 1.
    """
    known = sorted({joint for joint in joints if joint is not None})
    if not known:
        return "the robot"
    if len(known) == 1:
        return f"joint {known[0]}"
    return f"joints {', '.join(map(str, known[:-1]))} and {known[-1]}"


def action_for(effect: str, joints: Iterable[int | None]) -> str:
    """Says what to do about an effect of the catalogue.

    Args:
        effect: its name.
        joints: where it acts, counted from 1.
    """
    return ACTIONS[effect].format(place=place_of(joints)) if effect in FAULTS else MODEL


def sentence_for(effects: Iterable[tuple[str, int | None]]) -> str:
    """Says in one sentence what to do about several effects; equal actions name their joints together.

    Args:
        effects: name of the effect and joint, counted from 1 or None.
    """
    places: dict[str, list[int | None]] = {}
    for effect, joint in effects:
        places.setdefault(effect, []).append(joint)
    wanted = [action_for(effect, joints) for effect, joints in places.items() if effect in FAULTS] or [MODEL]
    return " ".join(dict.fromkeys(wanted))


def verdict_of(view: DiagnosisView) -> str:
    """Says in one sentence what to do.

    Args:
        view: the diagnosis.
    """
    errors = (view.nrmse_before, view.nrmse_after, view.nrmse_every)
    forbidden = standing_verdict(view.verdict, *errors, view.limits)
    if forbidden:
        return f"{forbidden} Record {view.next_kind} and diagnose again." if view.next_kind else forbidden
    if view.verdict == "none":
        return "No missing effect was found: use the model as it is."
    if view.verdict == "named":
        known = sentence_for((finding.effect, finding.joint) for finding in view.findings)
        return f"{known} {view.findings[0].sentence}" if len(view.findings) == 1 else known
    # A free function does not name a cause, whatever its gain.
    helps = any(finding.interval[0] > 0 and finding.named for finding in view.findings)
    why = "part of the error has no known cause" if helps else "no effect of the catalogue explains the residual"
    if view.verdict == "ambiguous":
        why = "several causes fit"
    if view.next_kind:
        return f"Record {view.next_kind} and diagnose again: {why}."
    return f"Check logs and robot: {why}, and no known experiment finds it."


def _code(finding: FindingView, confirmed: bool) -> str:
    if not finding.named:
        return "diagnosis.unexplained"
    return f"effect.{finding.effect}" if confirmed else "diagnosis.note"


def findings_in(view: DiagnosisView) -> tuple[Finding, ...]:
    """Lists effects, unexplained residuals, close rivals and notes.

    Args:
        view: the diagnosis.
    """
    standing = standing_of(view.verdict, view.nrmse_before, view.nrmse_after, view.nrmse_every)
    confirmed = standing != "unconfirmed"
    found = [
        Finding(
            code=_code(finding, confirmed),
            subject=f"{finding.title[:1].upper()}{finding.title[1:]}:",
            text=finding.sentence,
            action=action_for(finding.effect, [finding.joint]) if finding.named and confirmed else "",
        )
        for finding in view.findings
    ]
    if standing != "sound":
        errors = (view.nrmse_before, view.nrmse_after, view.nrmse_every)
        found += findings_of(f"diagnosis.{standing}", [standing_text(view.verdict, *errors, view.limits)])
    found += findings_of("diagnosis.unexplained", view.unexplained)
    if view.verdict == "unexplained" and not any(item.code == "diagnosis.unexplained" for item in found):
        found += findings_of("diagnosis.unexplained", ["Part of the residual is not noise and has no known cause."])
    for finding in view.findings:
        close = [title for title, worse in finding.rivals if worse < CLOSE_RIVAL_BIC]
        if view.verdict == "ambiguous" and close:
            text = f"{finding.title} explains the logs hardly better than {', '.join(close)}."
            found.append(Finding(code="diagnosis.ambiguous", text=f"{text[:1].upper()}{text[1:]}"))
    if view.verdict == "ambiguous" and not any(item.code == "diagnosis.ambiguous" for item in found):
        found.append(Finding(code="diagnosis.ambiguous", text="Several causes explain the logs about as well."))
    seen = summarise_limits(view.limits) if view.verdict == "none" else ""
    return (*found, *findings_of("diagnosis.note", view.warnings), *findings_of("done", [f"{seen}."] if seen else []))
