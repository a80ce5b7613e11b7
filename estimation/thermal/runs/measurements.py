"""The measurements of each run, by kind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.thermal.runs.thermal_run import ThermalRun
from robots.common.arrays import Array
from robots.thermal import ThermalModel


@dataclass(frozen=True, kw_only=True, eq=False)
class Row:
    """Measurements of one kind in one run.

    Attributes:
        run: index of the run.
        channel: ``friction``, or a zone's name.
        index: of the run's times that were measured (M,).
        measured: friction ratio, or temperature [degC] (M,).
        relative: standard deviation, but for the channel's own level (M,).
    """

    run: int
    channel: str
    index: NDArray[np.intp]
    measured: Array
    relative: Array


def rows_of(kind: type[ThermalModel], runs: Sequence[ThermalRun]) -> list[Row]:
    """Collects the measurements of all runs that a model can say something of."""
    found = []
    for r, run in enumerate(runs):
        ratio = run.ratio
        index = np.flatnonzero(np.isfinite(ratio))
        if len(index):
            cold = np.abs(np.asarray(run.cold_friction))[index]
            relative = 1.0 / (cold * np.sqrt(np.asarray(run.weight)[index]))
            found.append(Row(run=r, channel="friction", index=index, measured=ratio[index], relative=relative))
        for zone, values in run.readings(kind).items():
            index = np.flatnonzero(np.isfinite(values))
            if len(index):
                found.append(
                    Row(run=r, channel=zone, index=index, measured=values[index], relative=np.ones(len(index)))
                )
    return found
