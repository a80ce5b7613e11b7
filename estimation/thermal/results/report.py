"""Evaluation of a finished thermal fit: values, standard errors, combinations and notes."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from estimation.thermal.results.curvature import fit_curved
from estimation.thermal.results.derived import Quantity, derive, span
from estimation.thermal.results.estimate import RunFit, ThermalEstimate
from estimation.thermal.runs.thermal_run import ThermalRun
from estimation.thermal.transcriptions.coordinates import from_coordinate
from estimation.thermal.transcriptions.information import Information, gather
from estimation.thermal.transcriptions.noise import split
from estimation.thermal.transcriptions.search import Search, first_ambient
from estimation.thermal.transcriptions.solve import solve
from estimation.thermal.transcriptions.transcription import Solution, Transcription
from estimation.uncertainty.quantiles import normal_quantile
from robots.common.arrays import Array
from robots.thermal import ThermalModel


def report(search: Search, solution: Solution, warm: tuple[int, ...], *, bounds: bool = True) -> ThermalEstimate:
    """Collects values, standard errors, combinations and remarks."""
    info = gather(search.problem, solution, search.free, search.weights, search.prior)
    count = len(search.kind.parameters)
    at, covariance = solution.coordinates[:count], info.covariance[:count, :count]
    model = search.model_at(at)
    friction = any(run.has_friction for run in search.runs)
    powers = _powers(search)
    predicted = search.problem.predict(solution.coordinates, solution.states)
    curved = fit_curved(search, solution, info.colour, predicted) if bounds else None
    derived = partial(derive, search.model_at, at, covariance, powers, friction=friction, heat_known=search.heat_known)
    plain = derived()
    combinations = derived(curved=curved)
    scales = _slopes(search, at)
    parameters = _parameters(search, model, np.sqrt(np.maximum(np.diag(covariance), 0.0)) * np.abs(scales))
    lowest, notes = _slow(search, solution, info, plain, powers) if bounds else ({}, [])
    channels = np.concatenate([np.full(len(row.index), row.channel == "friction") for row in search.problem.rows])
    seen = span(channels, predicted, info, curved)
    notes = [*search.structure.notes, *notes, *_notes(search, solution, parameters, warm)]
    white = search.weights * (predicted - search.problem.measured)
    likelihood = float(-0.5 * white @ white + np.log(search.weights / np.sqrt(2 * np.pi)).sum())
    return ThermalEstimate(
        model=model,
        parameters=parameters,
        combinations=combinations if seen is None else (*combinations, seen),
        bounds=lowest,
        covariance=covariance * scales[:, None] * scales,
        runs=_run_fits(search, solution, predicted),
        noise=dict(search.levels.levels),
        proportional=search.levels.proportional,
        colour=info.colour,
        log_likelihood=likelihood,
        rows=len(predicted),
        free=int(search.free.sum()),
        success=solution.success,
        status=solution.status,
        notes=tuple(notes),
    )


def _slopes(search: Search, at: Array) -> Array:
    """Derivatives of the parameters by their coordinates (p,)."""
    pairs = zip(search.kind.parameters, at, strict=True)
    return np.array(
        [(from_coordinate(p, float(c) + 1e-6) - from_coordinate(p, float(c) - 1e-6)) / 2e-6 for p, c in pairs]
    )


def _parameters(search: Search, model: ThermalModel, errors: Array) -> tuple[Quantity, ...]:
    found = []
    for parameter, error in zip(search.kind.parameters, errors, strict=True):
        name, value = parameter.name, getattr(model, parameter.name)
        given = name in search.structure.fixed
        open_ = name in search.structure.conventions or name in search.structure.scaled
        # A heat exchange that is too small to see is known to be small.
        small = parameter.lower == 0.0 and error < 0.1 * max(abs(value), _largest_exchange(model))
        found.append(
            Quantity(
                name=name,
                value=float(value),
                unit=parameter.unit,
                standard_error=float("inf") if given else float(error),
                determined=not open_ and (given or bool(error <= 0.5 * abs(value)) or small),
            )
        )
    return tuple(found)


def _powers(search: Search) -> tuple[float, ...]:
    if not search.heat_known:
        return (0.0,)
    means = sorted({round(mean, 2) for mean in (_mean_power(run) for run in search.runs) if mean > 0}, reverse=True)
    return (*means[:6], 0.0)


def _slow(
    search: Search, solution: Solution, info: Information, combinations: tuple[Quantity, ...], powers: tuple[float, ...]
) -> tuple[dict[str, float], list[str]]:
    slow = combinations[0]
    longest = max(run.duration for run in search.runs)
    if slow.standard_error <= 0.25 * slow.value and slow.value <= 1.5 * longest:
        return {}, []
    bound = slow_bound(
        search.problem, solution, search.free, search.weights, search.prior, powers[0], slow.value, info.colour
    )
    why = "The data are too short for" if slow.value > longest / 1.5 else "The data do not determine"
    text = (
        f"{why} the {slow.name}. It is "
        f"at least {bound / 60:.3g} min (95 %, profile likelihood); the longest run has {longest / 60:.3g} min."
    )
    return {slow.name: bound}, [text]


def _notes(search: Search, solution: Solution, parameters: tuple[Quantity, ...], warm: tuple[int, ...]) -> list[str]:
    remarks = []
    for r in warm:
        start = ", ".join(f"{value:.1f}" for value in search.layout.start_at(solution.coordinates, r))
        remarks.append(f"{search.runs[r].name} does not start at ambient temperature; estimated start: {start} degC.")
    lower, upper = search.layout.bounds()
    for i, parameter in enumerate(search.kind.parameters):
        edge = min(abs(solution.coordinates[i] - lower[i]), abs(solution.coordinates[i] - upper[i]))
        if search.free[i] and edge < 1e-3 and not (parameter.lower == 0.0 and parameter.name != "alpha"):
            value = search.layout.values_at(solution.coordinates)[parameter.name]
            remarks.append(f"{parameter.name} is at its bound {value:.3g}.")
    lost = [p.name for p in parameters if not p.determined and p.name not in search.structure.conventions]
    if lost and not search.structure.conventions:
        remarks.append(f"Not determined by these runs: {', '.join(lost)}.")
    if not solution.success:
        remarks.append("The fit stopped before it converged; check its plot.")
    return remarks


def _run_fits(search: Search, solution: Solution, predicted: Array) -> tuple[RunFit, ...]:
    found = []
    for row, values in zip(search.problem.rows, split(search.problem.rows, predicted), strict=True):
        run = search.runs[row.run]
        cold = np.asarray(run.cold_friction)[row.index] if row.channel == "friction" else np.ones(len(row.index))
        around = search.layout.ambient_at(solution.coordinates, row.run)
        if run.ambient is not None:
            around = first_ambient(run, search.T0)
        found.append(
            RunFit(
                name=run.name,
                channel=row.channel,
                t=run.t[row.index],
                heating=run.heating[row.index],
                measured=row.measured * cold,
                predicted=values * cold,
                power=_mean_power(run),
                start=tuple(float(v) for v in search.layout.start_at(solution.coordinates, row.run)),
                ambient=around,
            )
        )
    return tuple(found)


def _largest_exchange(model: ThermalModel) -> float:
    """Gives the largest heat exchange of a model [W/K], beside which another may be small."""
    return max(getattr(model, p.name) for p in model.parameters if p.name[0] == "K")


def _mean_power(run: ThermalRun) -> float:
    steps, power = np.diff(run.t), run.held_power
    under = power > 0
    return float(power[under] @ steps[under] / steps[under].sum()) if under.any() else 0.0


# Fall of the log likelihood at a one-sided 95 % bound.
FALL = normal_quantile(0.95) ** 2 / 2


def slow_bound(
    problem: Transcription,
    solution: Solution,
    free: NDArray[np.bool_],
    weights: Array,
    prior: Array,
    power: float,
    estimate: float,
    colour: float,
) -> float:
    """Finds the least slow time constant at which the rest of the model can still explain the data.

    Args:
        problem: the runs.
        solution: of the fit.
        free: which coordinates may move.
        weights: of the measurements.
        prior: of the surroundings.
        power: at which the time constant holds [W].
        estimate: the fit's time constant [s].
        colour: ratio of the standard errors to those of white noise.

    Returns:
        The bound [s].
    """
    allowed = solution.cost + FALL * colour**2
    high, low = float(np.log(estimate)), float(np.log(estimate / 100.0))
    current = solution.coordinates

    def kept(constant: float) -> Solution:
        # Where the rest is at its bounds, IPOPT goes on for ever about a cost that it has long found.
        return solve(problem, current, free, weights, prior, slow=(power, float(np.exp(constant))), max_iterations=400)

    # Bisections of the logarithm: the bound is found to 2 %.
    for _ in range(7):
        middle = (low + high) / 2.0
        tried = kept(middle)
        close = abs(problem.slow_gap(tried.coordinates, power, float(np.exp(middle)))) < 1e-3
        if close and tried.cost <= allowed:
            high, current = middle, tried.coordinates
        else:
            low = middle
    return float(np.exp(high))
