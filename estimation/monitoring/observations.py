"""What a window gives to each quantity: friction without what all joints share, offsets, payload and residual."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.monitoring.control_charts.quantities import Quantity
from estimation.monitoring.windows.heat import HeatState
from estimation.monitoring.windows.projection import Window
from robots.common.arrays import Array


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
        # Standard deviation of the log of a residual RMS between windows of other motions, beside that of its noise.
        noise_of_rms = 0.1**2 + window.residual_variance(j)
        values.append(Value(place + 1 + j, float(np.log(window.residual_rms[j])), noise_of_rms, one))
    levels = np.array([q.level.coefficients[-1] for q in quantities[:n]])
    return values, Seen(known=known, friction=y, noise=noise, heat=explained - levels + sensitivity @ whole)


def _common(heat_state: HeatState, rest: Array, variances: Array) -> tuple[Array, Array, Array, Array]:
    """Sensitivities (n, 2), variances (n,) with unlogged work, the common unknowns (2,) and their covariance."""
    n, work = heat_state.n, heat_state.work
    paused = any(heat_state.sensitivity(j)[1] != 0.0 for j in range(n))
    before = list(work.duties)
    # Sensitivities depend on the duty.
    for _ in range(4 if paused else 1):
        sensitivity = np.array([heat_state.sensitivity(j) for j in range(n)])
        total = variances + np.array([heat_state.unlogged(j) for j in range(n)]) ** 2
        whole, covariance = common_change(rest, total, sensitivity, heat_state.common_spread, None)
        if paused:
            work.duties = [*before, float(whole[1])]
    return sensitivity, total, whole, covariance


COMMON_CHANGE_ROUNDS = 10


def common_change(
    deviations: Array, variances: Array, sensitivities: Array, spread: Array, leave: int | None
) -> tuple[Array, Array]:
    """Estimates the unknowns that all joints share, such as an error of the ambient temperature.

    Weighted least squares with a normal prior; joints that deviate from the others by more than two standard deviations
    count less (Huber 1964), and by more than four not at all: a damaged joint must not move the others.

    Args:
        deviations: of the logs of friction (n,); NaN where unknown.
        variances: of them (n,).
        sensitivities: to the common unknowns (n, k).
        spread: prior standard deviations of the unknowns (k,); zero for none.
        leave: a joint that is left out, counted from 0; None for none.

    Returns:
        The unknowns (k,) and their covariance (k, k).
    """
    used = np.isfinite(deviations) & np.isfinite(variances) & (sensitivities != 0).any(axis=1)
    if leave is not None:
        used[leave] = False
    found, covariance = np.zeros(len(spread)), np.diag(np.square(spread))
    live = (spread > 0) & (sensitivities[used] != 0).any(axis=0)
    if not live.any():
        return found, covariance
    d, S, v = deviations[used], sensitivities[used][:, live], variances[used]
    prior = np.diag(spread[live] ** -2.0)
    values = _start(d, S, v, prior)
    inverse = np.linalg.inv(prior)
    for _ in range(COMMON_CHANGE_ROUNDS):
        distance = np.abs(d - S @ values) / np.sqrt(v)
        weight = np.where(distance < 4.0, np.minimum(1.0, 2.0 / np.maximum(distance, 2.0)) ** 2, 0.0) / v
        inverse = np.linalg.inv(prior + (S * weight[:, None]).T @ S)
        values = inverse @ (S.T @ (weight * d))
    found[live] = values
    covariance[np.ix_(live, live)] = inverse
    return found, covariance


def _start(d: Array, S: Array, v: Array, prior: Array) -> Array:
    """Unknowns to begin with: an iteration from zero would follow the joint that deviates most."""
    if S.shape[1] == 1:
        seen = S[:, 0] != 0
        return np.array([np.median(d[seen] / S[seen, 0])])
    # Least absolute deviations.
    values: Array = np.zeros(S.shape[1])
    for _ in range(2 * COMMON_CHANGE_ROUNDS):
        weight = 1.0 / (np.sqrt(v) * np.maximum(np.abs(d - S @ values), 0.1 * np.sqrt(v)))
        values = np.asarray(np.linalg.solve(prior + (S * weight[:, None]).T @ S, S.T @ (weight * d)), dtype=np.float64)
    return np.asarray(values)
