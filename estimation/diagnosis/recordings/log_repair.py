"""Repair of logs before a diagnosis: outliers are replaced, logs are cut at gaps, findings of the gate become notes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimation.gate import GateReport, check_log
from estimation.gate.finding import Finding
from estimation.gate.measurements.outliers import interpolated
from estimation.regressions.torque_meanings import as_joint_torque
from robots.robot import Robot
from robots.signals import Log

Array = NDArray[np.float64]

# Gate findings that an effect of the robot may cause, or that the diagnosis reports itself.
TOLERATED = frozenset(
    {
        "badly_excited",
        "jump",
        "moved_by_others",
        "negative_friction",
        "no_motion",
        "other_robot",
        "poorly_explained",
        "position_sign",
        "short",
        "torque_sign",
        "unit_of_torque",
    }
)
# Gate warnings that the diagnosis examines more closely.
OWN = frozenset({"badly_excited", "clipped", "delay", "hardly_moves", "poorly_explained", "unit_of_torque"})
# Duration [s] below which a stretch between gaps is dropped: filters are inaccurate at its ends.
SHORTEST = 2.0

_BY_FIT = " (from a quick fit of rigid body and friction)"


@dataclass(frozen=True)
class RepairedLog:
    """A log without recording errors that could pass for an effect of the robot.

    Attributes:
        logs: its stretches between gaps.
        notes: what was wrong, and what was done about it.
    """

    logs: tuple[Log, ...]
    notes: tuple[str, ...]


def repair_log(robot: Robot, log: Log, which: str) -> RepairedLog:
    """Replaces outliers in a log and cuts it at its gaps.

    A lost message looks like a torque of one millisecond, which would be identified as a contact. Interpolation over a
    gap would invent a motion.

    Args:
        robot: the robot.
        log: the log as recorded.
        which: name of the log in notes.

    Returns:
        The usable stretches of the log, and notes.

    Raises:
        InputError: the gate refuses the log, for example positions in degrees, times in milliseconds, absurd values, or
            motor torques.
    """
    log = as_joint_torque(robot, log)
    gate = check_log(robot, log)
    replace(gate, findings=tuple(f for f in gate.findings if f.name not in TOLERATED)).raise_if_refused()
    notes = [
        f"{which}{_BY_FIT if finding.name in TOLERATED else ''}: {finding}."
        for finding in gate.findings
        if _is_reported(finding)
    ]
    log = gate.corrected(log)
    return RepairedLog(_stretches(interpolated(log) if len(gate.spikes) else log, gate), tuple(notes))


def _is_reported(finding: Finding) -> bool:
    if finding.severity == "refuse":
        return finding.name not in ("no_motion", "short")
    return finding.severity == "warning" and finding.name not in OWN


def _stretches(log: Log, gate: GateReport) -> tuple[Log, ...]:
    """Cuts a log at its gaps and where a column froze; keeps it whole if no stretch is long enough."""
    spans = [(first, stop) for first, stop in gate.parts if log.t[stop - 1] - log.t[first] >= SHORTEST]
    if gate.parts == ((0, len(log)),) or not spans:
        return (_fresh(log, gate, 0, len(log)),)
    parts = (_fresh(log, gate, first, stop) for first, stop in spans)
    return tuple(
        replace(part, name=f"{log.name or 'log'} from {part.t[0]:.4g} to {part.t[-1]:.4g} s") for part in parts
    )


def _fresh(log: Log, gate: GateReport, first: int, stop: int) -> Log:
    """Selects the rows of a stretch that are not stale."""
    if not len(gate.stale):
        return log if stop - first == len(log) else log.rows(slice(first, stop))
    return log.rows(np.setdiff1d(np.arange(first, stop), gate.stale))
