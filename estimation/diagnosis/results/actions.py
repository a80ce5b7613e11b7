"""The verdict of a diagnosis in words, and what to do about the effects that it finds."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from estimation.diagnosis.calibration import CLOSE_RIVAL_BIC
from estimation.diagnosis.findings import Finding
from estimation.diagnosis.hypothesis_tests.fitted_effects import is_close_rival
from robots.common.plain import place_of, several
from robots.common.records.findings import FAULTS
from robots.terms.effects import EFFECTS

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
"""Sentences with the place left open, of each of `FAULTS`."""


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


def close_causes(finding: Finding) -> list[str]:
    """Names the other causes that explain the logs hardly worse than a finding.

    Args:
        finding: of a diagnosis.
    """
    return [name.replace("_", " ") for name, worse in finding.rivals if worse < CLOSE_RIVAL_BIC]


def state_verdict(verdict: str, findings: Sequence[Finding]) -> str:
    """States the verdict in one line, with the known causes and their joints.

    Args:
        verdict: ``none``, ``named``, ``ambiguous`` or ``unexplained``.
        findings: all findings of the diagnosis.

    Returns:
        One line of text.
    """
    joints: dict[str, list[int]] = {}
    for finding in findings:
        if finding.effect != "unexplained":
            joints.setdefault(finding.effect, []).extend([finding.joint] if finding.joint else [])
    known = ", ".join(name + _at_joints(sorted(places)) for name, places in sorted(joints.items()))
    count = f"{several(len(joints), 'known cause')} found: {known}" if known else ""
    if verdict == "named" and known:
        return count
    return _VERDICTS[verdict] + (f"; {count}" if known else "")


def _at_joints(joints: Sequence[int]) -> str:
    if not joints:
        return " (whole robot)"
    return f" (joint{'s' if len(joints) > 1 else ''} {', '.join(map(str, joints))})"


_VERDICTS = {
    "none": "no significant effect found; base model and noise explain the residual",
    "named": "a known cause was found",
    "ambiguous": "several known causes explain the residual about equally well",
    "unexplained": "part of the residual is significant, and no effect of the catalogue explains it",
}


def format_p_value(value: float) -> str:
    """Formats a p-value with three decimals, or as ``< 0.001``."""
    return f"{value:.3f}" if value >= 0.001 else "< 0.001"


def close_rivals(finding: Finding) -> list[str]:
    """Lists the causes that fit about as well as a finding, each with the difference in BIC."""
    close = []
    for name, worse in finding.rivals:
        effect = EFFECTS.get(name.split(" of joint ")[0])
        if is_close_rival(effect is not None and effect.rare, worse):
            close.append(f"{name} ({worse:.0f})")
    return close
