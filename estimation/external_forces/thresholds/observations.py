"""A log as the calibrated observer sees it: filtered residual, its standard deviation, and their squared distance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from estimation.external_forces.residuals.filters import filtered, time_constant
from estimation.external_forces.residuals.friction_levels import contact_weight
from estimation.external_forces.residuals.signals import Signals
from estimation.external_forces.thresholds.calibrations import Calibration
from estimation.external_forces.thresholds.error_models import ErrorModel
from robots.common.arrays import Array


@dataclass(frozen=True, eq=False)
class Observed:
    """Filtered signals of one log.

    Attributes:
        residual: external torque (N, n) [N m or N].
        deviation: its standard deviation on a healthy robot (N, n) [N m or N].
        statistic: squared distance of the residual from zero (N,).
    """

    residual: Array
    deviation: Array
    statistic: Array


def lag_of(signals: Signals, bandwidth: float) -> Callable[..., Array]:
    """Gives the observer's filter on the times of a log."""
    constant = time_constant(bandwidth)

    def lag(x: Array, *, from_zero: bool = False) -> Array:
        return filtered(x, signals.t, constant, signals.begins, from_zero=from_zero)

    return lag


def observe(signals: Signals, errors: ErrorModel, bandwidth: float) -> Observed:
    """Filters the external torque of a log and scales it by the error model."""
    lag = lag_of(signals, bandwidth)
    residual = lag(signals.external, from_zero=True)
    deviation = errors.deviation(lag(errors.amplitudes(signals.dq, signals.friction, signals.variance)))
    return Observed(residual, deviation, errors.statistic(residual, deviation))


def observe_robustly(signals: Signals, calibration: Calibration) -> tuple[Signals, Observed]:
    """Observes a log whose contacts hardly move the level of friction that is followed.

    The weights follow from the statistic, and the statistic from the level. The sample-by-sample observer finds both
    one after the other; here they are repeated until nothing changes.

    Returns:
        The signals with that level, and what is observed.
    """
    weights = np.ones(len(signals.t))
    # Rounds in which the friction's level and the weights of the samples adapt to each other, ...
    for _ in range(12):
        observed = observe(signals, calibration.errors, calibration.bandwidth)
        before, weights = weights, contact_weight(observed.statistic / calibration.threshold.value)
        # ... until the weights have settled.
        if np.abs(weights - before).max() <= 1e-3:
            break
        signals = signals.levelled(weights)
    return signals, observed
