"""What a window gives to each quantity: friction without what all joints share, offsets, payload and residual."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.monitoring.control_charts.quantities import Quantity
from estimation.monitoring.windows.common_change import common_change
from estimation.monitoring.windows.heat import HeatState
from estimation.monitoring.windows.projection import Window

Array = NDArray[np.float64]

# Standard deviation of the log of a residual RMS between windows of other motions, beside that of its noise.
RESIDUAL_NOISE = 0.1
DUTY_ROUNDS = 4


@dataclass(frozen=True, eq=False)
class Value:
    """What a window gives to one quantity.

    Attributes:
        index: of the quantity.
        value: measured.
        variance: of its noise.
        features: (m,).
        unlogged: standard deviation of what unlogged work in the last pause does to it.
    """

    index: int
    value: float
    variance: float
    features: Array
    unlogged: float = 0.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Seen:
    """Friction of one window.

    Attributes:
        known: joints whose friction the window determines (n,).
        friction: log of the friction over the model's (n,), NaN where unknown.
        noise: its variance (n,).
        heat: the part that temperature explains (n,).
    """

    known: NDArray[np.bool_]
    friction: Array
    noise: Array
    heat: Array


def observed_values(
    heat_state: HeatState, quantities: Sequence[Quantity], window: Window, known: NDArray[np.bool_]
) -> tuple[list[Value], Seen]:
    """Gives each quantity its value.

    Args:
        heat_state: in the middle of the window.
        quantities: all of them, see `initial_quantities`.
        window: after its projection.
        known: joints whose friction factor the window determines (n,).

    Returns:
        The value of each quantity that the window determines, and the friction.
    """
    payloads = sum(q.group == "payload" for q in quantities)
    n, known = heat_state.n, np.array(known)
    error = np.sqrt(np.diag(window.covariance))
    features = [heat_state.features(j) for j in range(n)]
    known &= np.array([f is not None for f in features])
    y = np.where(known, np.log(np.where(known, window.values[:n], 1.0)), np.nan)
    noise = np.where(known, (error[:n] / np.where(known, window.values[:n], 1.0)) ** 2, np.nan)
    explained, spread = np.zeros(n), np.full(n, np.nan)
    for j in np.flatnonzero(known).tolist():
        level = quantities[j].level
        explained[j], unsure = level.explained(features[j])  # type: ignore[arg-type]
        spread[j] = noise[j] + unsure + level.deviation**2
    rest, unknown = y - explained, heat_state.common_spread
    sensitivity, spread, whole, covariance = _common(heat_state, rest, spread)
    own = np.full(n, np.nan)
    values: list[Value] = []
    for j in np.flatnonzero(known).tolist():
        others, _ = common_change(rest, spread, sensitivity, unknown, j)
        own[j] = y[j] - sensitivity[j] @ others
        values.append(Value(j, own[j], float(noise[j]), np.asarray(features[j]), heat_state.unlogged(j)))
    one = np.ones(1)
    for k in range(n + payloads):
        if window.determined[n + k]:
            values.append(Value(n + k, float(window.values[n + k]), float(error[n + k] ** 2), one))
    place = 2 * n + payloads
    if unknown[0] > 0 and known.any():
        values.append(Value(place, float(whole[0]), float(covariance[0, 0]), one))
    for j in np.flatnonzero(window.moves).tolist():
        noise_of_rms = RESIDUAL_NOISE**2 + window.residual_variance(j)
        values.append(Value(place + 1 + j, float(np.log(window.residual_rms[j])), noise_of_rms, one))
    levels = np.array([q.level.coefficients[-1] for q in quantities[:n]])
    return values, Seen(known=known, friction=y, noise=noise, heat=explained - levels + sensitivity @ whole)


def _common(heat_state: HeatState, rest: Array, variances: Array) -> tuple[Array, Array, Array, Array]:
    """Sensitivities (n, 2), variances (n,) with unlogged work, the common unknowns (2,) and their covariance."""
    n, work = heat_state.n, heat_state.work
    paused = any(heat_state.sensitivity(j)[1] != 0.0 for j in range(n))
    before = list(work.duties)
    # Sensitivities depend on the duty.
    for _ in range(DUTY_ROUNDS if paused else 1):
        sensitivity = np.array([heat_state.sensitivity(j) for j in range(n)])
        total = variances + np.array([heat_state.unlogged(j) for j in range(n)]) ** 2
        whole, covariance = common_change(rest, total, sensitivity, heat_state.common_spread, None)
        if paused:
            work.duties = [*before, float(whole[1])]
    return sensitivity, total, whole, covariance
