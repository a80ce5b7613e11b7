"""What a window gives to each quantity: friction without what all joints share, offsets, payload and residual."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.monitoring.control_charts.quantities import Quantity
from estimation.monitoring.windows.heat import HeatState, common_change
from estimation.monitoring.windows.projection import Window

Array = NDArray[np.float64]

# Standard deviation of the log of a residual RMS between windows of other motions, beside that of its noise.
RESIDUAL_NOISE = 0.1


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
) -> tuple[list[tuple[int, float, float, Array]], Seen]:
    """Gives each quantity its value.

    Args:
        heat_state: in the middle of the window.
        quantities: all of them, see `initial_quantities`.
        window: after its projection.
        known: joints whose friction factor the window determines (n,).

    Returns:
        Index of the quantity, value, variance and features (m,) of each that the window determines; and the friction.
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
    sensitivity = np.array([heat_state.sensitivity(j) for j in range(n)])
    rest = y - explained
    unknown = heat_state.common_spread
    whole, whole_variance = common_change(rest, spread, sensitivity, unknown, None)
    own = np.full(n, np.nan)
    values: list[tuple[int, float, float, Array]] = []
    for j in np.flatnonzero(known).tolist():
        others, _ = common_change(rest, spread, sensitivity, unknown, j)
        own[j] = y[j] - sensitivity[j] * others
        values.append((j, own[j], float(noise[j]), np.asarray(features[j])))
    one = np.ones(1)
    for k in range(n + payloads):
        if window.determined[n + k]:
            values.append((n + k, float(window.values[n + k]), float(error[n + k] ** 2), one))
    place = 2 * n + payloads
    if unknown > 0 and known.any():
        values.append((place, whole, whole_variance, one))
    for j in np.flatnonzero(window.moves).tolist():
        noise_of_rms = RESIDUAL_NOISE**2 + window.residual_variance(j)
        values.append((place + 1 + j, float(np.log(window.residual_rms[j])), noise_of_rms, one))
    levels = np.array([q.level.coefficients[-1] for q in quantities[:n]])
    return values, Seen(known=known, friction=y, noise=noise, heat=explained - levels + sensitivity * whole)
