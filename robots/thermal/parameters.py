"""Parameters and inputs of a thermal model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple


@dataclass(frozen=True, kw_only=True)
class ThermalParameter:
    """One parameter of a thermal model.

    Attributes:
        name: as in the model's fields.
        unit: its unit.
        lower: the least value that a fit may take.
        upper: the greatest.
        typical: of an industrial joint of some 100 W; where a fit begins.
        positive: whether it must be above zero, so that a fit may search its logarithm.
        meaning: in a few words.
    """

    name: str
    unit: str
    lower: float
    upper: float
    typical: float
    positive: bool
    meaning: str


class Inputs(NamedTuple):
    """Inputs of a joint's thermal model: numbers, arrays or CasADi expressions.

    Attributes:
        power: W, power that the friction would take at the temperature T0 [W].
        ambient: ambient temperature Te [degC].
        T3: reading of a thermocouple beside the joint [degC]; None where there is none.
        drives: 1 where the drives are powered, 0 where not.
    """

    power: Any
    ambient: Any
    T3: Any = None
    drives: Any = 1.0


ALPHA = ThermalParameter(
    name="alpha", unit="1/K", lower=-0.2, upper=0.0, typical=-0.01, positive=False, meaning="slope of the friction"
)
BETA = ThermalParameter(
    name="beta",
    unit="1",
    lower=0.2,
    upper=5.0,
    typical=1.0,
    positive=True,
    meaning="friction at T0 divided by its reference",
)


def exchange(name: str, meaning: str, typical: float = 4.0) -> ThermalParameter:
    """Describes a heat exchange coefficient [W/K]."""
    return ThermalParameter(
        name=name, unit="W/K", lower=1e-3, upper=1e4, typical=typical, positive=True, meaning=meaning
    )


def capacity(name: str, meaning: str, typical: float, unit: str = "J/K") -> ThermalParameter:
    """Describes a heat capacity."""
    return ThermalParameter(name=name, unit=unit, lower=0.1, upper=1e7, typical=typical, positive=True, meaning=meaning)
