"""Preparation of logs: common clock, notes of the gate, recording without unusable logs, and base parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimation.diagnosis.base_models.baseline import base_parameters
from estimation.diagnosis.base_models.payload_and_gravity import subtract_known_payload
from estimation.diagnosis.calibration import MAX_UNEXPLAINED_POWER
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.recordings.recording import Recording
from estimation.linear_algebra.orthonormal import orthonormal
from estimation.logs.clocks import put_on_clock
from estimation.recordings import Recording as Ready
from estimation.uncertainty.correlations import effective_rows
from robots.base_parameters import BaseParameters
from robots.common.errors import InputError, NotIdentifiableError
from robots.signals import Log
from robots.terms import FINE_BENDS, BendingFriction, FrictionTerm
from robots.terms.friction import USUAL_SPEED_SHARE

# Findings of the gate that an effect of the robot may cause, or that the diagnosis reports itself.
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
# Warnings of the gate that the diagnosis examines more closely, and findings on logs without a fault.
OWN = frozenset({"badly_excited", "clipped", "delay", "hardly_moves", "poorly_explained", "unit_of_torque"})
NO_MOTION = frozenset({"no_motion", "short"})
# Duration [s] below which a stretch between gaps is dropped: filters are inaccurate at its ends.
SHORTEST = 2.0
# Independent values of torque per parameter below which the parameters only follow the noise. They are counted within
# windows [s]: slower errors are those of the model, which more rows of the same motion do not reduce.
INDEPENDENT, WINDOW = 2.0, 1.0
# Directions of the scaled regressor below this share of the largest are not determined by the log.
UNDETERMINED = 1e-7
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


def prepare_logs(fit: Ready, unseen: Ready | None, friction: str | FrictionTerm) -> PreparedLogs:
    """Puts logs on one clock, and leaves out those that no base model explains.

    Args:
        fit: logs of the fit.
        unseen: logs for validation; None without.
        friction: of the base model: `auto` (`BendingFriction`), another name, or a term.

    Returns:
        The prepared logs.

    Raises:
        InputError: logs that do not determine the parameters, or given twice.
        NotIdentifiableError: no joint moves.
    """
    robot = fit.robot
    clocked = put_on_clock(fit.used, unseen.used if unseen else ())
    notes = [*clocked.notes, *_notes(fit, "Log")]
    logs = sorted(_on_clock(fit, clocked.logs), key=lambda log: float(log.t[0]))
    other: list[Log] = []
    if unseen:
        notes += _notes(unseen, "Held out")
        other = _on_clock(unseen, clocked.held_out)
    recording = subtract_known_payload(robot, build_recording(robot, logs))
    if not (np.ptp(recording.q, axis=0) > 0).any():
        raise NotIdentifiableError("no joint moves", remedy="record a log in which the arm moves")
    # Held-out logs count too: a gravity that occurs only there needs the robot's description as a prior.
    gravities = [log.gravity for log in (*logs, *other) if log.gravity is not None]
    speeds = np.quantile(np.abs(recording.dq), USUAL_SPEED_SHARE, axis=0)
    # A curve that the base model cannot follow would have a name.
    chosen = BendingFriction.within(speeds, FINE_BENDS) if friction == "auto" else friction
    base = base_parameters(robot, chosen, (FIRST_VELOCITY_SCALE,) * robot.n, gravities)
    if unusable := find_unusable_logs(base, recording):
        notes += [_UNUSABLE.format(k + 1, _in_brackets(recording.names[k]), 100 * s) for k, s in unusable.items()]
        logs = [log for k, log in enumerate(logs) if k not in unusable]
        recording = subtract_known_payload(robot, build_recording(robot, logs))
    require_information(base, recording)
    return PreparedLogs(tuple(logs), tuple(other), recording, base, clocked.dated, tuple(notes))


_UNUSABLE = (
    "Log {}{} is left out: even when fitted to this log alone, the base model leaves {:.0f} % of the torque on every "
    "joint. Check its torque signal."
)


def _on_clock(ready: Ready, clocked: Sequence[Log]) -> list[Log]:
    """Gives the usable parts of logs, at the times that these logs have on one clock."""
    found: list[Log] = []
    for log, placed, repaired in zip(ready.used, clocked, ready.repaired(SHORTEST), strict=True):
        shift = float(placed.t[0] - log.t[0])
        parts = [replace(part, t=part.t + shift) if shift else part for part in repaired]
        if len(parts) > 1 or parts[0].duration < 0.99 * log.duration:
            name = log.name or "log"
            parts = [replace(part, name=f"{name} from {part.t[0]:.4g} to {part.t[-1]:.4g} s") for part in parts]
        found += parts
    return found


def _notes(ready: Ready, kind: str) -> list[str]:
    """Says what the gate found and the diagnosis does not report itself."""
    notes = []
    for k, (log, gate) in enumerate(zip(ready.logs, ready.gates, strict=False), start=1):
        for finding in gate.findings:
            known = NO_MOTION if finding.severity == "refuse" else OWN
            if finding.severity != "info" and finding.name not in known:
                by_fit = _BY_FIT if finding.name in TOLERATED else ""
                notes.append(f"{kind} {k}{_in_brackets(log.name)}{by_fit}: {finding}.")
    return notes


_BY_FIT = " (from a quick fit of rigid body and friction)"


def _in_brackets(name: str) -> str:
    return f" ({name})" if name else ""


# Rows of each log that are used, and values that must count per base parameter.
ROWS, ENOUGH = 2000, 3


def find_unusable_logs(base: BaseParameters, recording: Recording) -> dict[int, float]:
    """Finds logs that the base model hardly explains, whatever its parameters.

    The base model, with friction, masses and offsets, is fitted to each log alone. Examples are a drive that rings in
    saturation, or torque of another robot. Such a log would distort the base model with which effects are searched in
    the others.

    Args:
        base: the base model.
        recording: a recording of several logs.

    Returns:
        By index of the log, in the order of time and from 0: the share of the torque's RMS that remains, on the joint
        where it is least. Empty if this holds for all logs, or if there is one log only.
    """
    if len(recording.runs) < 2:
        return {}
    left: dict[int, float] = {}
    for k, (run, gravity) in enumerate(zip(recording.runs, recording.gravities, strict=True)):
        rows = slice(run.start, run.stop, max(1, (run.stop - run.start) // ROWS))
        motion = recording.q[rows], recording.dq[rows], recording.ddq[rows]
        counts = ~recording.sign_unknown[rows]
        Y = base.regressor(*motion, gravity=gravity) * counts[:, :, None]
        tau = recording.tau[rows] * counts
        squares = (tau**2).sum(axis=0)
        acts = squares > 0
        if counts.sum() < ENOUGH * base.size or not acts.any():
            continue
        # Joints count alike, whatever the size of their torques.
        weights = np.where(acts, 1.0 / np.sqrt(np.where(acts, squares, 1.0)), 0.0)
        A, y = (Y * weights[:, None]).reshape(-1, Y.shape[2]), (tau * weights).reshape(-1)
        errors = (y - A @ np.linalg.lstsq(A, y, rcond=None)[0]).reshape(tau.shape)
        share = float((errors**2).sum(axis=0)[acts].min())
        if share > MAX_UNEXPLAINED_POWER:
            left[k] = float(np.sqrt(share))
    return left if len(left) < len(recording.runs) else {}


def require_information(base: BaseParameters, recording: Recording) -> None:
    """Refuses logs whose torque holds too few independent values for the parameters that their motion excites.

    The limit is neither a number of rows nor a duration: noise may be correlated over many rows.

    Args:
        base: the base model.
        recording: all logs of the fit.

    Raises:
        InputError: stating both numbers.
    """
    known = ~recording.sign_unknown
    weights = known / np.maximum(recording.tau.std(axis=0), 1e-12)
    runs = zip(recording.runs, recording.gravities, strict=True)
    Y = [base.regressor(recording.q[r], recording.dq[r], recording.ddq[r], gravity=gravity) for r, gravity in runs]
    A = (np.concatenate(Y) * weights[:, :, None]).reshape(-1, base.size)
    Q, y = orthonormal(A, UNDETERMINED), (recording.tau * weights).reshape(-1)
    left = (y - Q @ (Q.T @ y)).reshape(recording.tau.shape)
    values = 0.0
    for series in (left[known[:, j], j] for j in range(recording.n)):
        windows = np.array_split(series, max(1, round(len(series) * recording.step / WINDOW)))
        values += sum(effective_rows(part) for part in windows if len(part) and np.ptp(part) > 0)
    if values < INDEPENDENT * Q.shape[1]:
        raise InputError(
            f"{recording.duration:.1f} s of usable logs hold about {values:.0f} independent values of torque for "
            f"{Q.shape[1]} parameters",
            file=recording.names[0] if len(recording.names) == 1 else None,
            allowed=f"{INDEPENDENT:g} values per parameter or more",
            remedy="record a longer log, or one with faster and more varied motion",
        )
