"""The second-order thermal model of a joint: two heat capacities, one of which the friction heats (thesis eq. 116)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from robots.thermal.base import ThermalModel
from robots.thermal.pairs import PairExponential
from robots.thermal.parameters import ALPHA, BETA, Inputs, ThermalParameter, capacity, exchange


@dataclass(frozen=True, kw_only=True)
class SecondOrder(PairExponential, ThermalModel):
    """Zone 1 is heated by friction and gives heat to zone 2, which passes it to the environment.

        C1 dT1/dt = W (alpha (T1 - T0) + beta) - K1 (T1 - T2)
        C2 dT2/dt = K1 (T1 - T2) - K2 (T2 - Te)

    Args:
        K1: heat exchange between the zones [W/K].
        K2: heat exchange with the environment [W/K].
        C1: heat capacity of the heat source [J/K].
        C2: heat capacity of the surrounding structure [J/K].
    """

    name: ClassVar[str] = "second"
    parameters: ClassVar[tuple[ThermalParameter, ...]] = (
        ALPHA,
        BETA,
        exchange("K1", "heat exchange between the zones"),
        exchange("K2", "heat exchange with the environment"),
        capacity("C1", "heat capacity of the heat source", 700.0),
        capacity("C2", "heat capacity of the surrounding structure", 7000.0),
    )
    zones: ClassVar[tuple[str, ...]] = ("T1", "T2")

    K1: float
    K2: float
    C1: float
    C2: float

    @classmethod
    def rates(cls, p: Mapping[str, Any], x: Sequence[Any], u: Inputs) -> list[Any]:
        """The balances of thesis eq. 116."""
        T1, T2 = x
        heat = u.power * (p["alpha"] * (T1 - p["T0"]) + p["beta"])
        through = p["K1"] * (T1 - T2)
        return [(heat - through) / p["C1"], (through - p["K2"] * (T2 - u.ambient)) / p["C2"]]

    def rise(self, time: float) -> float:
        """Bounds the warming by 1 W within a time [s] from equilibrium [K]: all of it stays in zone 1."""
        return time / self.C1
