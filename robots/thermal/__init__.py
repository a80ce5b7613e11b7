"""How joints warm up by their own friction, and what the warmth does to the friction."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from robots.common.errors import InputError
from robots.thermal.advanced import Advanced
from robots.thermal.base import ThermalModel
from robots.thermal.c_code import generate_c
from robots.thermal.first_order import FirstOrder
from robots.thermal.fractional import Fractional
from robots.thermal.known import KnownThermal, known_thermal
from robots.thermal.mittag_leffler import mittag_leffler
from robots.thermal.motion import ThermalPath, cold_friction, friction_power, simulate_cycles, simulate_motion
from robots.thermal.online import ObserverSettings, OnlineFriction
from robots.thermal.parameters import Inputs, ThermalParameter
from robots.thermal.second_order import SecondOrder

# Adding a model is one file, and one line here.
THERMAL_MODELS: dict[str, type[ThermalModel]] = {
    "first": FirstOrder,
    "second": SecondOrder,
    "fractional": Fractional,
    "advanced": Advanced,
}
_ALIASES = {"1": "first", "2": "second"}


def thermal_model_class(order: str | int) -> type[ThermalModel]:
    """Finds a thermal model by its name.

    Args:
        order: ``first`` or 1, ``second`` or 2, ``fractional``, ``advanced``.

    Raises:
        InputError: an unknown name.
    """
    name = _ALIASES.get(str(order), str(order))
    if name not in THERMAL_MODELS:
        raise InputError(f"unknown thermal model {order!r}", allowed=", ".join((*_ALIASES, *THERMAL_MODELS)))
    return THERMAL_MODELS[name]


def build_thermal_model(description: Mapping[str, Any]) -> ThermalModel:
    """Reads what `ThermalModel.to_dict` wrote.

    Raises:
        InputError: an unknown model, or settings that it does not have.
    """
    settings = dict(description)
    kind = thermal_model_class(settings.pop("model", "second"))
    try:
        return kind(**settings)
    except TypeError as error:
        raise InputError(f"thermal model {kind.name}: {error}") from error


__all__ = [
    "THERMAL_MODELS",
    "Advanced",
    "FirstOrder",
    "Fractional",
    "Inputs",
    "KnownThermal",
    "ObserverSettings",
    "OnlineFriction",
    "SecondOrder",
    "ThermalModel",
    "ThermalParameter",
    "ThermalPath",
    "build_thermal_model",
    "cold_friction",
    "friction_power",
    "generate_c",
    "known_thermal",
    "mittag_leffler",
    "simulate_cycles",
    "simulate_motion",
    "thermal_model_class",
]
