"""How an extended model's motion is smoothed when it predicts another log: as it predicts its own logs best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimation.diagnosis.problem import Problem
from estimation.model import Model
from estimation.prediction import predict
from robots.signals import Log

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
