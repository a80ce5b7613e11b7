"""The numbers that a thermal fit searches: logarithms where a parameter must be positive, all of the size of one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi
import numpy as np
from numpy.typing import NDArray

from estimation.thermal.runs.thermal_run import ThermalRun
from robots.common.arrays import Array
from robots.thermal import ThermalModel, ThermalParameter

# Temperatures are counted from T0 in tens of degrees.
DEGREES_PER_COORDINATE = 10.0
# Coordinates of parameters that may be zero, per unit.
_SCALES = {"alpha": 0.01, "W_e": 10.0, "nu": 1.0}


def to_coordinate(parameter: ThermalParameter, value: float) -> float:
    """Gives the search coordinate of a parameter: a logarithm where it must be positive."""
    if parameter.positive and parameter.name != "nu":
        return float(np.log(value))
    return value / _SCALES.get(parameter.name, 1.0)


def from_coordinate(parameter: ThermalParameter, coordinate: Any) -> Any:
    """Gives the parameter at a search coordinate, a number or a CasADi expression."""
    if parameter.positive and parameter.name != "nu":
        return np.exp(coordinate) if isinstance(coordinate, float) else casadi.exp(coordinate)
    return coordinate * _SCALES.get(parameter.name, 1.0)


@dataclass(frozen=True, eq=False)
class Layout:
    """Where things are among the coordinates: parameters, then each run's start temperatures and surroundings.

    Attributes:
        kind: the thermal model.
        runs: R runs.
        T0: temperature at which the cold friction holds [degC].
    """

    kind: type[ThermalModel]
    runs: tuple[ThermalRun, ...]
    T0: float

    @property
    def size(self) -> int:
        """Number of coordinates P."""
        return len(self.kind.parameters) + len(self.runs) * (len(self.kind.zones) + 1)

    def start_slots(self, run: int) -> slice:
        """Coordinates of a run's start temperatures."""
        first = len(self.kind.parameters) + run * (len(self.kind.zones) + 1)
        return slice(first, first + len(self.kind.zones))

    def ambient_slot(self, run: int) -> int:
        """Coordinate of a run's surroundings."""
        return self.start_slots(run).stop

    @property
    def ambient_slots(self) -> NDArray[np.intp]:
        """Coordinates of all runs' surroundings (R,)."""
        return np.array([self.ambient_slot(run) for run in range(len(self.runs))], dtype=np.intp)

    def to_coordinates(self, values: Mapping[str, float], starts: Sequence[Array], ambients: Sequence[float]) -> Array:
        """Collects coordinates (P,) from parameters, start temperatures and surroundings [degC]."""
        parts = [[to_coordinate(p, values[p.name]) for p in self.kind.parameters]]
        for start, around in zip(starts, ambients, strict=True):
            parts.append(
                [*((np.asarray(start) - self.T0) / DEGREES_PER_COORDINATE), (around - self.T0) / DEGREES_PER_COORDINATE]
            )
        return np.concatenate([np.asarray(part, dtype=np.float64) for part in parts])

    def values_at(self, coordinates: Array) -> dict[str, float]:
        """Gives the parameters by name, and T0."""
        found = {p.name: float(from_coordinate(p, coordinates[i])) for i, p in enumerate(self.kind.parameters)}
        return {**found, "T0": self.T0}

    def start_at(self, coordinates: Array, run: int) -> Array:
        """Gives a run's start temperatures (z,) [degC]."""
        return self.T0 + DEGREES_PER_COORDINATE * coordinates[self.start_slots(run)]

    def ambient_at(self, coordinates: Array, run: int) -> float:
        """Gives a run's surroundings [degC] where they were not measured."""
        return self.T0 + DEGREES_PER_COORDINATE * float(coordinates[self.ambient_slot(run)])

    def bounds(self) -> tuple[Array, Array]:
        """Gives the least and greatest coordinates (P,)."""
        lower, upper = np.full(self.size, -np.inf), np.full(self.size, np.inf)
        for i, parameter in enumerate(self.kind.parameters):
            lower[i] = to_coordinate(parameter, parameter.lower)
            upper[i] = to_coordinate(parameter, parameter.upper)
            if parameter.name == "beta" and self.runs[0].power is None:
                # It stands for the heat itself.
                lower[i], upper[i] = to_coordinate(parameter, 1e-6), to_coordinate(parameter, 1e6)
        return lower, upper
