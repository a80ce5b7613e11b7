"""The first-order thermal model of a joint: one heat capacity that friction heats (thesis eq. 95 to 115)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from robots.thermal.base import ThermalModel
from robots.thermal.parameters import ALPHA, BETA, Inputs, ThermalParameter, capacity, exchange


@dataclass(frozen=True, kw_only=True)
class FirstOrder(ThermalModel):
    """One zone that gives its heat to the environment.

        C dT/dt = W (alpha (T - T0) + beta) - K (T - Te)

    The time constant is C / (K - W alpha) under power and C / K without (thesis eq. 112 and 115).

    Args:
        K: heat exchange with the environment [W/K].
        C: heat capacity [J/K].
    """

    name: ClassVar[str] = "first"
    parameters: ClassVar[tuple[ThermalParameter, ...]] = (
        ALPHA,
        BETA,
        exchange("K", "heat exchange with the environment", 3.0),
        capacity("C", "heat capacity", 3000.0),
    )
    zones: ClassVar[tuple[str, ...]] = ("T",)

    K: float
    C: float

    @classmethod
    def rates(cls, p: Mapping[str, Any], x: Sequence[Any], u: Inputs) -> list[Any]:
        """The balance of thesis eq. 99 with eq. 105."""
        (T,) = x
        heat = u.power * (p["alpha"] * (T - p["T0"]) + p["beta"])
        return [(heat - p["K"] * (T - u.ambient)) / p["C"]]

    def rise(self, time: float) -> float:
        """Bounds the warming by 1 W within a time [s] from equilibrium [K]: all of it stays."""
        return time / self.C
