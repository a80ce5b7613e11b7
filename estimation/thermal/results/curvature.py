"""A second fit whose friction falls exponentially: what a fit with the linear fall cannot know of its errors."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from estimation.thermal.runs.run_temperatures import run_temperatures
from estimation.thermal.runs.thermal_run import ThermalRun
from estimation.thermal.transcriptions.search import Search
from estimation.thermal.transcriptions.transcription import Solution
from robots.common.arrays import Array
from robots.thermal import ThermalModel

# Heat and friction of the exponential fall depend on each other; their iteration ends at this relative change.
SETTLED_FALL, MOST_FALL_ROUNDS = 1e-7, 30


@dataclass(frozen=True, kw_only=True, eq=False)
class CurvedFit:
    """The fit with an exponential fall of friction.

    Attributes:
        model: its parameters; to be read with the exponential fall.
        predicted: measurements by it (M,).
        probability: that it is the right one of the two fits, if both are as likely before the logs are seen.
    """

    model: ThermalModel
    predicted: Array
    probability: float


def fit_curved(search: Search, solution: Solution, colour: float, predicted: Array) -> CurvedFit | None:
    """Fits beta exp(alpha (T - T0) / beta) in place of alpha (T - T0) + beta to the same measurements.

    Viscosity falls exponentially with temperature. Over the temperatures of one campaign both falls fit nearly alike,
    with different time constants and steady states.

    Args:
        search: of the fit with the linear fall.
        solution: its result.
        colour: honest over white-noise standard errors.
        predicted: measurements by it (M,).

    Returns:
        The fit; None without friction, or where it does not change with temperature.
    """
    rows, free = search.problem.rows, search.free
    if not search.heat_known or not any(row.channel == "friction" for row in rows):
        return None
    if search.model_at(solution.coordinates).alpha == 0.0:
        return None
    lower, upper = search.layout.bounds()
    low, high = lower[free], upper[free]
    prior = np.zeros(search.problem.size)
    prior[search.layout.ambient_slots] = search.prior

    def whole(values: Array) -> Array:
        coordinates = solution.coordinates.copy()
        coordinates[free] = values
        return search.tied(coordinates)

    def errors(values: Array) -> Array:
        coordinates = whole(values)
        white = search.weights * (_predictions(search, coordinates) - search.problem.measured)
        return np.concatenate([white, (prior * (coordinates - begin))[free]])

    # Surroundings stay where the prior has them: about where the first fit found them.
    begin = solution.coordinates
    first = np.clip(solution.coordinates[free], low + 1e-9, high - 1e-9)
    tolerance = 1e-6
    found = least_squares(errors, first, bounds=(low, high), x_scale="jac", ftol=tolerance, xtol=tolerance, max_nfev=40)
    coordinates = whole(found.x)
    curved = _predictions(search, coordinates)
    gain = _squares(search, predicted) - _squares(search, curved)
    odds = float(np.clip(gain / (2.0 * colour**2), -50.0, 50.0))
    return CurvedFit(
        model=search.model_at(coordinates), predicted=curved, probability=float(1.0 / (1.0 + np.exp(-odds)))
    )


def curved_factor(model: ThermalModel, temperature: Array) -> tuple[Array, Array]:
    """Friction factor with the exponential fall, and what it is over that of the linear fall."""
    linear = model.friction_factor(temperature)
    factor = model.beta * np.exp(linear / model.beta - 1.0)
    return factor, factor / np.maximum(linear, 0.01 * model.beta)


def curved_steady_state(model: ThermalModel, power: float) -> float:
    """Temperature where heat is produced at constant power, with the exponential fall [degC]."""
    T, more = np.nan, 1.0
    for _ in range(MOST_FALL_ROUNDS):
        T = float(model.steady_state(power * more, drives=0.0)[..., 0])
        before, more = more, float(curved_factor(model, np.array(T))[1])
        if abs(more - before) < SETTLED_FALL:
            break
    return T


def curved_slope(model: ThermalModel, temperature: float) -> ThermalModel:
    """Model whose linear friction falls as steeply as the exponential one does at a temperature."""
    return replace(model, alpha=model.alpha * float(curved_factor(model, np.array(temperature))[0]) / model.beta)


def _squares(search: Search, predicted: Array) -> float:
    return float(np.sum((search.weights * (predicted - search.problem.measured)) ** 2))


def _predictions(search: Search, coordinates: Array) -> Array:
    model = search.model_at(coordinates)
    paths = [
        _path(model, run, search.layout.start_at(coordinates, r), search.layout.ambient_at(coordinates, r))
        for r, run in enumerate(search.runs)
    ]
    parts = []
    for row in search.problem.rows:
        T = paths[row.run][row.index]
        friction = row.channel == "friction"
        parts.append(curved_factor(model, T[:, 0])[0] if friction else T[:, model.zones.index(row.channel)])
    return np.concatenate(parts)


def _path(model: ThermalModel, run: ThermalRun, start: Array, ambient: float) -> Array:
    more = np.ones(len(run.t))
    T = np.empty(0)
    for _ in range(MOST_FALL_ROUNDS):
        T = run_temperatures(model, run, list(start), ambient=ambient, factor=(more[1:] + more[:-1]) / 2.0)
        before, more = more, curved_factor(model, T[:, 0])[1]
        if np.abs(more - before).max() < SETTLED_FALL:
            break
    return T
