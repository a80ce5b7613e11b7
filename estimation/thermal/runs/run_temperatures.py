"""Temperatures of the zones of a run, by a thermal model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from estimation.thermal.runs.thermal_run import ThermalRun
from robots.common.arrays import Array
from robots.thermal import ThermalModel


def run_temperatures(
    model: ThermalModel,
    run: ThermalRun,
    start: Sequence[float],
    *,
    ambient: float | None = None,
    factor: ArrayLike = 1.0,
) -> Array:
    """Follows the zones through a run.

    Args:
        model: the thermal model.
        run: the run.
        start: temperatures of the zones at its first time [degC].
        ambient: surroundings, where the run does not say [degC].
        factor: on the run's power, one number or one in each of its steps.

    Returns:
        Temperatures at the run's times (N, zones) [degC].
    """
    around: Array | float | None = ambient
    if run.ambient is not None:
        values = np.asarray(run.ambient)
        seen = np.isfinite(values)
        around = np.interp(run.t, run.t[seen], values[seen])[:-1]
    T3 = None
    if run.T3 is not None and model.name == "advanced":
        seen = np.isfinite(run.T3)
        T3 = np.interp(run.t, run.t[seen], run.T3[seen])[:-1]
    return model.temperatures(
        run.held_power * np.asarray(factor),
        np.diff(run.t),
        start=list(start),
        ambient=around,
        T3=T3,
        drives=np.asarray(run.drives)[:-1],
    )
