"""Choice of the thermal model by held-out data."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimation.thermal.results.choice import Candidate, ThermalChoice, phase_errors
from estimation.thermal.results.estimate import ThermalEstimate
from estimation.thermal.runs.run_temperatures import run_temperatures
from estimation.thermal.runs.thermal_run import ThermalRun, named_apart
from estimation.thermal.thermal_fit import fit_thermal
from robots.common.arrays import Array
from robots.common.errors import InputError, OedError
from robots.common.progress import SILENT, Progress
from robots.thermal import THERMAL_MODELS, ThermalModel

HELD_OUT = ("runs", "end")


def choose_thermal(
    runs: ThermalRun | Sequence[ThermalRun],
    *,
    orders: Sequence[str] = tuple(THERMAL_MODELS),
    held_out: str | None = None,
    alpha: float | None = None,
    fixed: Mapping[str, Mapping[str, float]] | None = None,
    start: str = "auto",
    starts: int = 3,
    seed: int = 0,
    progress: Progress | None = None,
) -> ThermalChoice:
    """Fits several thermal models and compares them on held-out data.

    The simplest model whose held-out error is within 3 % of the best is chosen: the larger ones contain it, and a fit
    always profits from more parameters.

    Args:
        runs: heatings and coolings of one joint.
        orders: the models, simplest first.
        held_out: ``runs`` leaves out one run after the other, ``end`` the last third of each; whole runs by default
            where there are two or more.
        alpha: slope of the friction, where it is known [1/K].
        fixed: other known parameters, by model and name.
        start: see `fit_thermal`; settled once, by the first model that can decide.
        starts: see `fit_thermal`.
        seed: see `fit_thermal`.
        progress: receives the progress.

    Returns:
        The comparison.

    Raises:
        InputError: unknown models or options.
        OedError: what the last model said, where none could be fitted.
    """
    data = named_apart(runs)
    how = held_out or ("runs" if len(data) > 1 else "end")
    if how not in HELD_OUT or (how == "runs" and len(data) < 2):
        raise InputError(f"held out {how!r} of {len(data)} runs", allowed="end, or runs where there are two or more")
    if not orders:
        raise InputError("no models", allowed=", ".join(THERMAL_MODELS))
    bar = progress or SILENT
    fits = 1 + (len(data) if how == "runs" else 1)
    bar.start("comparing thermal models", float(len(orders) * fits))
    found: list[Candidate] = []
    trouble: OedError | None = None
    try:
        for k, order in enumerate(orders):
            own = dict((fixed or {}).get(order, {}))
            options: dict[str, Any] = {"order": order, "alpha": alpha, "fixed": own, "start": start, "seed": seed}
            try:
                estimate = fit_thermal(data, starts=starts, **options)
                errors = _held_out_errors(data, how, estimate, options, partial(_fitted, bar, fits * k + 1, order))
                found.append(
                    Candidate(
                        order=estimate.model.name,
                        estimate=estimate,
                        held_out=float(np.sqrt(np.mean(errors**2))),
                        heating=phase_errors(estimate.runs, heating=True),
                        cooling=phase_errors(estimate.runs, heating=False),
                    )
                )
            except InputError:
                raise
            except OedError as error:
                trouble = error
                found.append(
                    Candidate(
                        order=order, estimate=None, held_out=np.nan, heating=None, cooling=None, failure=str(error)
                    )
                )
            _fitted(bar, fits * k, order, fits)
    finally:
        bar.finish()
    usable = [item for item in found if item.estimate is not None]
    if not usable:
        assert trouble is not None
        raise trouble
    least = min(item.held_out for item in usable)
    # A larger model must bring the held-out error down by this share to be preferred.
    close = [item for item in usable if item.held_out <= 1.03 * least]
    best = min(close, key=lambda item: item.estimate.free if item.estimate else 0)
    return ThermalChoice(candidates=tuple(found), best=best.order, held_out=how)


def _fitted(bar: Progress, before: int, order: str, number: int) -> None:
    bar.update(float(before + number), order)


def _held_out_errors(
    data: list[ThermalRun], how: str, whole: ThermalEstimate, options: dict[str, Any], fitted: Callable[[int], None]
) -> Array:
    """Errors on what a fit had not seen: friction over its cold value, and temperatures [K]."""
    parts = []
    fitted(0)
    if how == "runs":
        for number, run in enumerate(data, start=1):
            rest = fit_thermal([other for other in data if other is not run], starts=1, bounds=False, **options)
            start = next(fit.start for fit in whole.runs if fit.name == run.name)
            parts.append(predict_run(rest.model, run, start)[1])
            fitted(number)
    else:
        cuts = [max(3, round(2 * len(run.t) / 3)) for run in data]
        short = [run.rows(slice(0, cut)) for run, cut in zip(data, cuts, strict=True)]
        rest = fit_thermal(short, starts=1, bounds=False, **options)
        for run, cut in zip(data, cuts, strict=True):
            start = next(fit.start for fit in rest.runs if fit.name == run.name)
            ambient = next(fit.ambient for fit in rest.runs if fit.name == run.name)
            index, errors = predict_run(rest.model, run, start, ambient=ambient)
            parts.append(errors[index >= cut])
    return np.concatenate(parts)


def predict_run(
    model: ThermalModel, run: ThermalRun, start: Sequence[float], *, ambient: float | None = None
) -> tuple[NDArray[np.intp], Array]:
    """Predicts a run from a start, and compares it with what was measured.

    Args:
        model: the thermal model.
        run: the run.
        start: temperatures of the zones at its first time [degC].
        ambient: surroundings, where the run does not say [degC].

    Returns:
        Which of the run's times each measurement belongs to (M,), and the errors (M,): friction over its cold value,
        and temperatures [K].
    """
    T = run_temperatures(model, run, start, ambient=ambient)
    index, errors = [], []
    known = np.flatnonzero(np.isfinite(run.ratio))
    index.append(known)
    errors.append(model.friction_factor(T[known, 0]) - run.ratio[known])
    for zone, readings in run.readings(type(model)).items():
        known = np.flatnonzero(np.isfinite(readings))
        index.append(known)
        errors.append(T[known, model.zones.index(zone)] - readings[known])
    return np.concatenate(index), np.concatenate(errors)
