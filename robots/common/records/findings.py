"""What a result says to its reader: how urgent it is, in a sentence, and what to do."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from robots.common.errors import InputError

Level = Literal["good", "note", "act"]

ORDER: tuple[Level, ...] = ("good", "note", "act")
WORDS: dict[Level, str] = {"good": "No action needed", "note": "Note", "act": "Action needed"}

FAULTS = (
    "backlash",
    "base_compliance",
    "base_tilt",
    "current_clipping",
    "encoder_eccentricity",
    "encoder_offset",
    "external_contact",
    "friction_step",
    "payload_change",
    "time_delay",
    "torque_constant_error",
    "torque_crosstalk",
    "torque_sensor_drift",
)
"""Effects that a healthy, correctly set up robot does not have; the others belong to a robot's design."""

LEVELS: dict[str, Level] = {
    "done": "good",
    # Experiments.
    "limit.exceeded": "act",
    "limit.exceeded_in_log": "note",
    "limit.assumed": "note",
    "value.assumed": "note",
    "torque.unchecked": "note",
    "collision.found": "act",
    "collision.unchecked": "act",
    "collision.sampled": "note",
    "stroke.left_out": "note",
    "excitation.incomplete": "act",
    "excitation.weak": "act",
    "timing.slower": "note",
    "experiment.unsure": "note",
    "experiment.note": "note",
    "detection.limited": "note",
    # Models.
    "joint.not_identified": "act",
    "logs.contradict": "act",
    "parameters.undetermined": "note",
    "model.warning": "note",
    "thermal.undetermined": "note",
    "joint.still": "note",
    "prediction.extrapolates": "note",
    "payload.uncertain": "note",
    "drives.effect": "note",
    "drives.note": "note",
    "drives.undetermined": "note",
    "drives.unexplained": "note",
    "calibration.doubtful": "act",
    "calibration.cause": "note",
    "calibration.outlier": "note",
    "calibration.open": "note",
    # Diagnoses and comparisons.
    "diagnosis.ambiguous": "act",
    "diagnosis.unexplained": "act",
    "diagnosis.unconfirmed": "act",
    "diagnosis.inaccurate": "act",
    "diagnosis.note": "note",
    "comparison.note": "note",
    "monitor.note": "note",
    "force.note": "note",
    "difference": "note",
    "difference.joint": "act",
    "difference.payload": "note",
    "contact": "act",
    "loop.unfinished": "act",
    # Logs and robots.
    "log.left_out": "note",
    "log.info": "good",
    "log.warning": "note",
    "log.refuse": "act",
    "change.info": "good",
    "change.watch": "note",
    "change.act": "act",
    "fleet.red": "act",
    "fleet.amber": "note",
    "fleet.grey": "act",
    "fleet.green": "good",
    "effect.design": "note",
    "effect.fault": "act",
}
"""What a code of a finding asks of its reader: nothing, to know it, or to act."""


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One thing that a reader must know.

    Args:
        code: a key of `LEVELS`, which decides how urgent it is.
        text: what was found, in a sentence.
        subject: joint, log or part that it is about; empty for the whole.
        action: what to do; empty where there is nothing to do.

    Raises:
        InputError: an unknown code.
    """

    code: str
    text: str
    subject: str = ""
    action: str = ""

    def __post_init__(self) -> None:
        severity([self.code])

    @property
    def level(self) -> Level:
        """How urgent it is."""
        return LEVELS[self.code]


def findings_of(code: str, texts: Iterable[str]) -> tuple[Finding, ...]:
    """Makes one finding of each text.

    Args:
        code: a key of `LEVELS`, of all of them.
        texts: what was found, each in a sentence or two.
    """
    return tuple(Finding(code=code, text=text) for text in texts)


def effect_code(effect: str) -> str:
    """Gives the code of an effect that was found: a fault of the robot, or a part of its design.

    Args:
        effect: its name in the catalogue.
    """
    return "effect.fault" if effect in FAULTS else "effect.design"


def severity(codes: Iterable[str]) -> Level:
    """Decides how urgent some findings are together: as the most urgent of them; "good" without any.

    Args:
        codes: keys of `LEVELS`.

    Raises:
        InputError: a code that no result has.
    """
    worst = 0
    for code in codes:
        if code not in LEVELS:
            raise InputError(f"the code {code!r} of a finding is unknown", allowed="a key of LEVELS")
        worst = max(worst, ORDER.index(LEVELS[code]))
    return ORDER[worst]
