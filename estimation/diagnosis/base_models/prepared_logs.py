"""Preparation of logs: common clock, repair, recording, and base parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimation.diagnosis.base_models.baseline import base_parameters
from estimation.diagnosis.base_models.payload_and_gravity import subtract_known_payload
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.recordings.log_repair import repair_log
from estimation.diagnosis.recordings.recording import Recording
from estimation.diagnosis.recordings.unusable_logs import find_unusable_logs
from estimation.logs.clocks import put_on_clock
from robots.base_parameters import BaseParameters
from robots.common.errors import NotIdentifiableError
from robots.common.forks import forked
from robots.robot import Robot
from robots.signals import Log
from robots.terms import FINE_BENDS, BendingFriction
from robots.terms.friction import USUAL

# Width of the friction sign [rad/s or m/s] before it is fitted to the logs.
FIRST_VELOCITY_SCALE = 0.001


@dataclass(frozen=True, eq=False)
class PreparedLogs:
    """Logs prepared for a diagnosis.

    Attributes:
        logs: logs of the fit, in the order of time, without unusable ones.
        held_out: logs for validation.
        recording: motion and torque of the logs of the fit.
        base: base parameters of the robot's model, under every gravity of the logs.
        dated: whether the time between the logs of the fit and the held-out logs is known.
        notes: what was repaired or left out.
    """

    logs: tuple[Log, ...]
    held_out: tuple[Log, ...]
    recording: Recording
    base: BaseParameters
    dated: bool
    notes: tuple[str, ...]


def prepare_logs(
    robot: Robot, logs: Sequence[Log], held_out: Sequence[Log], friction: str, *, check: bool
) -> PreparedLogs:
    """Puts logs on one clock, repairs them, and leaves out those that no base model explains.

    Args:
        robot: the robot.
        logs: logs of the fit.
        held_out: logs for validation.
        friction: friction of the base model: `auto` (`BendingFriction`), `polynomial` or `coulomb-viscous`.
        check: whether each log passes the gate, which refuses unusable logs and marks what needs repair.

    Returns:
        The prepared logs.

    Raises:
        InputError: logs of another robot, without torque, too short, given twice or refused by the gate.
        NotIdentifiableError: no joint moves.
    """
    clocked = put_on_clock(logs, held_out)
    fit, other = sorted(clocked.logs, key=lambda log: float(log.t[0])), list(clocked.held_out)
    notes = list(clocked.notes)
    if check:
        fit, fit_notes = _repaired(robot, fit, "Log")
        other, other_notes = _repaired(robot, other, "Held out")
        notes += [*fit_notes, *other_notes]
    recording = subtract_known_payload(robot, build_recording(robot, fit))
    if not (np.ptp(recording.q, axis=0) > 0).any():
        raise NotIdentifiableError("no joint moves", remedy="record a log in which the arm moves")
    # Held-out logs count too: a gravity that occurs only there needs the robot's description as a prior.
    gravities = [log.gravity for log in (*fit, *other) if log.gravity is not None]
    speeds = np.quantile(np.abs(recording.dq), USUAL, axis=0)
    # A curve that the base model cannot follow would have a name.
    chosen = BendingFriction.within(speeds, FINE_BENDS) if friction == "auto" else friction
    base = base_parameters(robot, chosen, (FIRST_VELOCITY_SCALE,) * robot.n, gravities)
    if unusable := find_unusable_logs(base, recording):
        notes += [_UNUSABLE.format(k + 1, _in_brackets(recording.names[k]), 100 * s) for k, s in unusable.items()]
        fit = [log for k, log in enumerate(fit) if k not in unusable]
        recording = subtract_known_payload(robot, build_recording(robot, fit))
    return PreparedLogs(tuple(fit), tuple(other), recording, base, clocked.dated, tuple(notes))


_UNUSABLE = (
    "Log {}{} is left out: even when fitted to this log alone, the base model leaves {:.0f} % of the torque on every "
    "joint. Check its torque signal."
)


def _repaired(robot: Robot, logs: Sequence[Log], kind: str) -> tuple[list[Log], list[str]]:
    """Returns the usable stretches of logs, and notes about them."""
    names = [f"{kind} {k}{_in_brackets(log.name)}" for k, log in enumerate(logs, start=1)]
    repaired = forked(lambda named: repair_log(robot, *named), zip(logs, names, strict=True))
    return [part for one in repaired for part in one.logs], [note for one in repaired for note in one.notes]


def _in_brackets(name: str) -> str:
    return f" ({name})" if name else ""
