"""The numbers that a thermal fit searches: logarithms where a parameter must be positive, all of the size of one."""

from __future__ import annotations

from typing import Any

import casadi
import numpy as np

from robots.thermal import ThermalParameter

# Temperatures are counted from T0 in tens of degrees.
DEGREES = 10.0
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
