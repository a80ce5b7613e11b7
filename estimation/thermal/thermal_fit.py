"""The verb: fits a thermal model to the heating and cooling of one joint."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from estimation.thermal.results.estimate import ThermalEstimate
from estimation.thermal.results.report import report
from estimation.thermal.runs.thermal_run import ThermalRun, named_apart
from estimation.thermal.transcriptions.search import Search, first_ambient
from estimation.thermal.transcriptions.structure import find_structure
from robots.common.errors import InputError
from robots.common.parallel import one_blas_thread
from robots.common.progress import SILENT, Progress
from robots.thermal import thermal_model_class

STARTS = ("auto", "ambient", "free")


@one_blas_thread()
def fit_thermal(
    runs: ThermalRun | Sequence[ThermalRun],
    *,
    order: str | int = "second",
    alpha: float | None = None,
    fixed: Mapping[str, float] | None = None,
    reference: float | None = None,
    start: str = "auto",
    starts: int = 3,
    seed: int = 0,
    bounds: bool = True,
    progress: Progress | None = None,
) -> ThermalEstimate:
    """Fits one thermal model to all runs of a joint at once, by direct collocation (models: thesis chapter 4).

    Args:
        runs: heatings and coolings of one joint, of different power if possible.
        order: ``first``, ``second``, ``fractional`` or ``advanced``.
        alpha: slope of the friction, where it is known [1/K]; estimated where a thermometer allows it.
        fixed: other parameters that are known, by name.
        reference: T0, the temperature at which the cold friction holds [degC]; that of the first run's surroundings by
            default.
        start: ``ambient`` where all runs start at ambient temperature, ``free`` where none is known to, or
            ``auto`` to let the data say.
        starts: how many times the search begins anew.
        seed: of where it begins.
        bounds: whether a time constant that the runs do not determine gets its lower bound (profile likelihood), which
            takes longer than the fit.
        progress: receives the progress.

    Returns:
        The estimate.

    Raises:
        InputError: no runs, or unknown options.
        NotIdentifiableError: runs that say nothing of heat.
        SolverError: no start led to a minimum.
    """
    data = named_apart(runs)
    if start not in STARTS or starts < 1:
        raise InputError(f"start {start!r}, {starts} starts", allowed=f"{', '.join(STARTS)}; one or more starts")
    kind = thermal_model_class(order)
    bar = progress or SILENT
    bar.start("fitting the thermal model", 4.0)
    try:
        structure = find_structure(kind, data, alpha, fixed or {})
        T0 = _reference(data) if reference is None else float(reference)
        fit = Search(kind, data, structure, T0, start)
        solution = fit.search(starts, np.random.default_rng(seed))
        bar.update(1.0, "noise")
        solution = fit.reweighted(solution)
        bar.update(2.0, "starts and mesh")
        solution, warm = fit.warm_starts(solution) if start == "auto" else (solution, ())
        solution = fit.refined(solution)
        bar.update(3.0, "standard errors")
        return report(fit, solution, warm, bounds=bounds)
    finally:
        bar.finish()


def _reference(runs: Sequence[ThermalRun]) -> float:
    return next((first_ambient(run, 20.0) for run in runs if run.ambient is not None), 20.0)
