"""What to do about each effect that a diagnosis finds."""

from __future__ import annotations

from collections.abc import Iterable

from oed.reports.rendering.severity import FAULTS

MODEL = "Use the extended model (model.json) instead of the robot's description."

ACTIONS = {
    "backlash": "Inspect the gear of {place} for play.",
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
