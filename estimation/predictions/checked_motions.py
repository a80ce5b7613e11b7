"""The check of a log whose torques are to be predicted, and the parts of its motion."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from estimation.gate import GateReport, check_log
from estimation.models.model import Model
from estimation.preprocessing import LowPass, Smoother, SmoothingSpline
from robots.common.errors import AssumedValueWarning
from robots.robot import Robot
from robots.signals import Log

JOINED = ("t", "q", "tau", "current", "ambient", "temperature")


def checked_motion(robot: Robot, log: Log) -> tuple[GateReport, list[Log]]:
    """Checks a log whose torques are to be predicted, and repairs its motion.

    Args:
        robot: of the model.
        log: with or without torque.

    Returns:
        The findings, those on torques as warnings at most; and the parts of the log between gaps, with unwrapped
        angles and interpolated outliers.

    Raises:
        InputError: the motion is wrong: units of time or position, wrapped angles, jumps, impossible values; or all
            parts are too short.
    """
    gate = check_log(robot, log).for_motion()
    gate.raise_if_refused()
    # Copied positions stay: what smooths them knows them, and a torque is wanted in every row.
    return gate, list(replace(gate, stale=gate.stale[:0]).usable(log, interpolate=("q", "tau", "current")))


def joined(parts: Sequence[Log]) -> Log:
    """Gives one log of several parts of it, with what a prediction needs."""
    first = parts[0]
    if len(parts) == 1:
        return first
    arrays = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in JOINED
        if getattr(first, name) is not None
    }
    return Log(**arrays, payload=first.payload, gravity=first.gravity, name=first.name, metadata=first.metadata)


def smoother_of(model: Model, cutoff: float) -> Smoother:
    """Gives the smoother of the model's data for another motion; a low-pass instead of harmonics."""
    smoothing = model.provenance.get("smoothing")
    kind = smoothing.get("kind") if isinstance(smoothing, Mapping) else None
    return SmoothingSpline(cutoff) if kind == SmoothingSpline.name else LowPass(cutoff)


def smoothed_at_least(model: Model, cutoff: float) -> Model:
    """Gives the model with its cut-off for other motions raised to one [Hz], if it is lower.

    The fit takes the lowest cut-off that its motions allow. Motions with stops need a higher one: a low-pass rings at a
    stop, and the sign of the friction follows the ringing.
    """
    if model.cutoff >= cutoff:
        return model
    return replace(model, provenance={**model.provenance, "cutoff_hz": cutoff})


def note_meaning(model: Model, log: Log) -> None:
    """Says that the model's logs held something else than joint torques, if the log does not state it.

    Args:
        model: with the provenance of its logs.
        log: with joint torques or currents, or without.
    """
    were = {str(entry.get("torque_was") or "") for entry in model.provenance.get("logs", ())}
    if (log.tau is None and log.current is None) or "torque_was" in log.metadata or not were or "" in were:
        return
    text = f"the torque columns of the model's logs were {', '.join(sorted(were))}; those of this log are read as joint"
    warnings.warn(AssumedValueWarning(f"{text} torques. If they hold the same, state --torque-is"), stacklevel=3)
