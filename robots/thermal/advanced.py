"""The second-order thermal model with the motor's heat and a thermocouple beside the joint (thesis eq. 144 to 153)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from robots.thermal.base import ThermalModel
from robots.thermal.pairs import PairExponential
from robots.thermal.parameters import ALPHA, BETA, Inputs, ThermalParameter, capacity, exchange


def _optional(name: str, unit: str, upper: float, meaning: str) -> ThermalParameter:
    return ThermalParameter(name=name, unit=unit, lower=0.0, upper=upper, typical=0.0, positive=False, meaning=meaning)


@dataclass(frozen=True, kw_only=True)
class Advanced(PairExponential, ThermalModel):
    """Zone 1 is heated by friction and by the powered drive; zone 3 is what a thermocouple beside the joint reads.

        C1 dT1/dt = W (alpha (T1 - T0) + beta) + W_e - K12 (T1 - T2) - K13 (T1 - T3)
        C2 dT2/dt = K12 (T1 - T2) - K23 (T2 - T3) - K2e (T2 - Te)

    (Thesis eq. 147; its eq. 147, 150 and 153 print alpha for a = W alpha, the slope of the heat with T1.) Where T3 is
    not measured, zone 3 is taken to hold no heat: what enters it leaves it, so that K13 and K23 in series exchange heat
    between zones 1 and 2.

    Args:
        K12: heat exchange between the zones [W/K].
        K2e: heat exchange with the environment [W/K].
        C1: heat capacity of the heat source [J/K].
        C2: heat capacity of the surrounding structure [J/K].
        W_e: heat of the powered drive: Joule effect and eddy currents [W].
        K13: heat exchange of zone 1 with zone 3 [W/K].
        K23: heat exchange of zone 2 with zone 3 [W/K].
    """

    name: ClassVar[str] = "advanced"
    parameters: ClassVar[tuple[ThermalParameter, ...]] = (
        ALPHA,
        BETA,
        exchange("K12", "heat exchange between the zones"),
        exchange("K2e", "heat exchange with the environment"),
        capacity("C1", "heat capacity of the heat source", 700.0),
        capacity("C2", "heat capacity of the surrounding structure", 7000.0),
        _optional("W_e", "W", 1e4, "heat of the powered drive"),
        _optional("K13", "W/K", 1e4, "heat exchange of zone 1 with zone 3"),
        _optional("K23", "W/K", 1e4, "heat exchange of zone 2 with zone 3"),
    )
    zones: ClassVar[tuple[str, ...]] = ("T1", "T2")

    K12: float
    K2e: float
    C1: float
    C2: float
    W_e: float = 0.0
    K13: float = 0.0
    K23: float = 0.0

    @classmethod
    def rates(cls, p: Mapping[str, Any], x: Sequence[Any], u: Inputs) -> list[Any]:
        """The balances of thesis eq. 147."""
        T1, T2 = x
        heat = u.power * (p["alpha"] * (T1 - p["T0"]) + p["beta"]) + p["W_e"] * u.drives
        through = p["K12"] * (T1 - T2)
        if u.T3 is None:
            # The tiny term keeps zero exchanges, which are in order, and their derivatives from dividing by zero.
            series = p["K13"] * p["K23"] / (p["K13"] + p["K23"] + 1e-9)
            first = second = series * (T1 - T2)
        else:
            first, second = p["K13"] * (T1 - u.T3), p["K23"] * (u.T3 - T2)
        return [
            (heat - through - first) / p["C1"],
            (through + second - p["K2e"] * (T2 - u.ambient)) / p["C2"],
        ]

    def rise(self, time: float) -> float:
        """Bounds the warming by 1 W within a time [s] from equilibrium [K]: all of it stays in zone 1."""
        return time / self.C1
