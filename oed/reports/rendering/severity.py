"""How urgent a report is: one table of codes, and one function that decides."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

from estimation.gate.finding import Severity as LogSeverity
from estimation.monitoring.findings import SEVERITIES as CHANGES
from estimation.monitoring.findings import Severity as ChangeSeverity
from robots.common.errors import InputError
from robots.terms.effects import EFFECTS

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

_OF_LOGS: dict[LogSeverity, Level] = {"info": "good", "warning": "note", "refuse": "act"}
_OF_CHANGES: dict[ChangeSeverity, Level] = {"info": "good", "watch": "note", "act": "act"}

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
    # Logs.
    "log.left_out": "note",
    **{f"log.{name}": level for name, level in _OF_LOGS.items()},
    **{f"change.{kind}": _OF_CHANGES[severity] for kind, severity in CHANGES.items()},
    "fleet.red": "act",
    "fleet.amber": "note",
    "fleet.grey": "act",
    "fleet.green": "good",
    **{f"effect.{name}": "act" if name in FAULTS else "note" for name in EFFECTS},
}
"""What a code of a result asks of its reader: nothing, to know it, or to act."""


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
