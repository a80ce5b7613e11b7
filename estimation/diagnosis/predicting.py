"""What an extended model needs to predict other logs: how their motion is smoothed, and how far it may be off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimation.comparison import band_of
from estimation.diagnosis.gain import PARTS, Unseen
from estimation.diagnosis.problem import Problem
from estimation.model import Model
from estimation.prediction import predict
from robots.signals import Log

Array = NDArray[np.float64]

# Of the longest log, this long a stretch in the middle [s] tells it, at so many cut-offs.
STRETCH, POINTS = 30.0, 5


def smoothed_best(model: Model, problem: Problem, logs: Sequence[Log]) -> Model:
    """States the cut-off of the motion with which a model predicts its own logs best.

    A diagnosis knows of each joint up to which frequency its torque is told by positions, and weighs by that. A
    prediction has one smoothing: with the highest of all cut-offs the encoders' noise on a heavy joint is most of its
    error, with the lowest a quick joint's friction turns round late.

    Args:
        model: whose provenance gets the cut-off [Hz].
        problem: what it was fitted in.
        logs: those of the fit, with torque.
    """
    cutoffs = [problem.recording.cutoff, *(band.cutoff for band in problem.whitening.bands)]
    low, high = min(cutoffs), max(cutoffs)
    log = max(logs, key=lambda log: float(log.t[-1] - log.t[0]))
    middle = 0.5 * float(log.t[0] + log.t[-1])
    part = log.rows(slice(*np.searchsorted(log.t, (middle - 0.5 * STRETCH, middle + 0.5 * STRETCH)).tolist()))
    tried = np.geomspace(low, high, POINTS if high > low else 1)
    stated = [replace(model, provenance={**model.provenance, "cutoff_hz": float(cutoff)}) for cutoff in tried]
    return min(stated, key=lambda one: _misfit(one, part))


def _misfit(model: Model, log: Log) -> float:
    """Mean over the joints of the logarithm of a prediction's error over the torque's spread."""
    spread = predict(model, log).relative_spread
    told = spread[np.isfinite(spread) & (spread > 0)]
    return float(np.mean(np.log(told))) if len(told) else 0.0


def with_band(model: Model, logs: Sequence[Log], held_out: Sequence[Log], unseen: Unseen) -> Model:
    """States the half-widths of a band that holds 95 % of the model's errors on data that its fit has not seen.

    Args:
        model: whose provenance gets them (n,) [N m or N], and the share of each part of the held-out logs that the band
            of the other parts holds (n,); None of a joint without any.
        logs: those of the fit, with torque.
        held_out: others. Without any, errors on the logs of the fit count as many times as much as errors grew on parts
            of them that fits had not seen.
        unseen: the errors on those.
    """
    if held_out:
        errors = [np.abs(part) for log in held_out for part in np.array_split(_errors(model, log), PARTS)]
        shares = [
            np.mean(error <= band_of(np.concatenate(errors[:k] + errors[k + 1 :])), axis=0)
            for k, error in enumerate(errors)
        ]
        covered = np.average(shares, axis=0, weights=[len(error) for error in errors])
    else:
        errors = [np.abs(_errors(model, log)) * unseen.growing() for log in logs]
        covered = np.full(model.robot.n, np.nan)
    stated = {"band95": _known(band_of(np.concatenate(errors))), "band95_coverage": _known(covered)}
    return replace(model, provenance={**model.provenance, **stated})


def _errors(model: Model, log: Log) -> Array:
    prediction = predict(model, log)
    assert prediction.measured is not None
    return prediction.measured - prediction.predicted


def _known(values: Array) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in values]
