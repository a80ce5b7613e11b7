"""What to do about the effects that a diagnosis finds."""

from __future__ import annotations

from collections.abc import Iterable

from estimation.diagnosis.calibration import CLOSE_RIVAL_BIC
from estimation.diagnosis.findings import Finding
from robots.common.plain import place_of
from robots.common.records.findings import FAULTS

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
