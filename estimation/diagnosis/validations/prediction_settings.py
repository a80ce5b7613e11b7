"""What an extended model needs to predict other logs: their smoothing, the sign's sharpness, how far it may be off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.base_models.baseline import SCALES
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.validations.gain_intervals import PARTS, HeldOutErrors
from estimation.identifications.comparison import band_of
from estimation.models.model import Model
from estimation.predictions.prediction import Prediction, predict
from estimation.regressions.preparation import torque_of
from robots.common.plain import all_finite, number
from robots.signals import Log
from robots.terms import FrictionPolynomial
from robots.terms.situations.of_model import sign_of, velocity_scale

Array = NDArray[np.float64]

# Of the longest log, this long a stretch in the middle [s] tells it, at so many cut-offs.
STRETCH, POINTS = 30.0, 5
# Rows of a log without which it tells no motion.
FEWEST = 50


def with_best_cutoff(model: Model, problem: Problem, logs: Sequence[Log]) -> Model:
    """States the cut-off of the motion with which a model predicts its own logs best.

    The diagnosis has a cut-off per joint. A prediction has one for all: with the highest, encoder noise dominates the
    error of a heavy joint; with the lowest, the friction of a fast joint reverses late.

    Args:
        model: whose provenance gets the cut-off [Hz].
        problem: what it was fitted in.
        logs: those of the fit, with torque.
    """
    cutoffs = [problem.recording.cutoff, *(band.cutoff for band in problem.whitening.bands)]
    low, high = min(cutoffs), max(cutoffs)
    part, before = _part(model, logs)
    tried = np.geomspace(low, high, POINTS if high > low else 1)
    stated = [replace(model, provenance={**model.provenance, "cutoff_hz": float(cutoff)}) for cutoff in tried]
    return min(stated, key=lambda one: _misfit(one, part, before))


def with_best_sign_sharpness(model: Model, logs: Sequence[Log]) -> Model:
    """States the sharpness of each joint's sign with which a model predicts its own logs best.

    A diagnosis gives up rows about reversals, and may be left with those that any sharpness suits: its model would turn
    friction round too gradually. A prediction has all rows, and another error by that in each of them.

    Args:
        model: whose terms get the velocities v0 of tanh(dq / v0), and whose provenance states them.
        logs: those of the fit, with torque.
    """
    columns = zip(model.parameters, model.values, strict=True)
    signs = {column.joint - 1: float(value) for column, value in columns if column.symbol == "f1"}
    (part, earlier), now = _part(model, logs), velocity_scale(model.torque_model)
    before = _predicted(model, part, earlier)
    error, chosen = _error(before), now.copy()
    for joint, coulomb in signs.items():
        dq = before.motion.dq[:, joint]
        own = error[:, joint] + coulomb * sign_of(dq, now[joint])
        squares = [np.nansum((own - coulomb * sign_of(dq, v0)) ** 2) for v0 in (now[joint], *SCALES)]
        chosen[joint] = (now[joint], *SCALES)[int(np.argmin(squares))]
    trial = _with_scales(model, chosen)
    # Effects turn round as sharply as the model's sign does: with theirs a joint may be worse off.
    better = _predicted(trial, part, earlier).error_rms < before.error_rms
    return _with_scales(model, np.where(better, chosen, now)) if better.any() else model


def _part(model: Model, logs: Sequence[Log]) -> tuple[Log, list[Log]]:
    """The middle of the longest log, and what came before."""
    log = max(logs, key=lambda log: float(log.t[-1] - log.t[0]))
    middle = 0.5 * float(log.t[0] + log.t[-1])
    part = log.rows(slice(*np.searchsorted(log.t, (middle - 0.5 * STRETCH, middle + 0.5 * STRETCH)).tolist()))
    return part, _before(model, part, logs)


def _before(model: Model, log: Log, logs: Sequence[Log]) -> list[Log]:
    """What of logs on one clock came before one of them, or a part of one, and has warmed it."""
    if not model.keeps_heat:
        return []
    parts = [own.rows(slice(0, int(np.searchsorted(own.t, log.t[0])))) for own in logs if own.t[0] < log.t[0]]
    return sorted((part for part in parts if len(part) >= FEWEST), key=lambda part: float(part.t[0]))


def _with_scales(model: Model, scales: Array) -> Model:
    """Gives the model whose signs are as sharp as v0 (n,) says."""
    stated = tuple(float(v0) for v0 in scales)
    terms = tuple(
        replace(term, velocity_scale=stated) if isinstance(term, FrictionPolynomial) else term
        for term in model.torque_model.terms
    )
    return replace(
        model,
        torque_model=replace(model.torque_model, terms=terms),
        provenance={**model.provenance, "velocity_scales": list(stated)},
    )


def _misfit(model: Model, log: Log, before: Sequence[Log]) -> float:
    """Mean over the joints of the logarithm of a prediction's error over the torque's spread."""
    spread = _predicted(model, log, before).relative_spread
    errors = spread[np.isfinite(spread) & (spread > 0)]
    return float(np.mean(np.log(errors))) if len(errors) else 0.0


def with_band(model: Model, logs: Sequence[Log], held_out: Sequence[Log], unseen: HeldOutErrors) -> Model:
    """States the half-widths of a band that holds 95 % of the model's errors on data that its fit has not seen.

    Args:
        model: whose provenance gets them (n,) [N m or N], the share of each part of the held-out logs that the band of
            the other parts holds (n,), None of a joint without any, and the errors' RMS over the torque's (n,).
        logs: those of the fit, with torque.
        held_out: others. Without any, errors on the logs of the fit count as many times as much as errors grew on parts
            of them that fits had not seen.
        unseen: the errors on those.
    """
    growth = np.ones(model.robot.n) if held_out else unseen.support_growth()
    every = [*logs, *held_out]
    errors = [np.abs(_error(_predicted(model, log, _before(model, log, every)))) * growth for log in held_out or logs]
    covered = np.full(model.robot.n, np.nan)
    if held_out:
        parts = [part for error in errors for part in np.array_split(error, PARTS)]
        shares = [
            np.mean(part <= band_of(np.concatenate(parts[:k] + parts[k + 1 :])), axis=0) for k, part in enumerate(parts)
        ]
        covered = np.average(shares, axis=0, weights=[len(part) for part in parts])
    found, torque = np.concatenate(errors), np.concatenate([torque_of(model.robot, log) for log in held_out or logs])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.sqrt(np.mean(found**2, axis=0) / np.mean(torque**2, axis=0))
    stated = {
        "band95": all_finite(band_of(found)),
        "band95_coverage": all_finite(covered),
        "unseen_nrmse": all_finite(share),
    }
    return replace(model, provenance={**model.provenance, **stated})


def all_row_errors(model: Model) -> Array:
    """Gives back the errors on unseen data that `with_band` states (n,); NaN where it is not known."""
    stated = model.provenance.get("unseen_nrmse")
    return np.full(model.robot.n, np.nan) if stated is None else np.array([number(value) for value in stated])


def _predicted(model: Model, log: Log, before: Sequence[Log] = ()) -> Prediction:
    """Predicts a log, or a part of one, that is on the clock of the fit, as are those before it."""
    return predict(model, log, later=0.0, before=before)


def _error(prediction: Prediction) -> Array:
    assert prediction.measured is not None
    return prediction.measured - prediction.predicted
