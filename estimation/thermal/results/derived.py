"""Combinations of parameters that the data determine, with standard errors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.thermal.results.curvature import CurvedFit, curved_factor, curved_slope, curved_steady_state
from estimation.thermal.transcriptions.information import Information
from estimation.uncertainty.quantiles import NORMAL_95
from robots.common.arrays import Array
from robots.thermal import ThermalModel


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A number with its standard error.

    Attributes:
        name: what it is.
        value: in its unit.
        unit: its unit.
        standard_error: infinite where nothing is known.
        determined: whether the data determine it.
    """

    name: str
    value: float
    unit: str
    standard_error: float
    determined: bool

    @property
    def half_width(self) -> float:
        """Half of the 95 % interval, in its unit."""
        return NORMAL_95 * self.standard_error


# Name of the ratio that is seen in the logs, without any extrapolation.
SPAN = "highest over lowest friction in the logs"


def derive(
    build: Callable[[Array], ThermalModel],
    at: Array,
    covariance: Array,
    powers: Sequence[float],
    *,
    friction: bool,
    heat_known: bool,
    curved: CurvedFit | None = None,
) -> tuple[Quantity, ...]:
    """Computes time constants, friction ratios and parameter ratios with their standard errors.

    Args:
        build: the model at search coordinates (p,).
        at: those of the fit (p,).
        covariance: of the coordinates (p, p).
        powers: at which to state time constants [W].
        friction: whether friction was measured.
        heat_known: whether the power is known.
        curved: the fit with an exponential fall, whose difference counts as an error by its probability; None for none.

    Returns:
        The quantities; their derivatives are finite differences.
    """
    names, units = _names(build(at), powers, friction, heat_known)

    def values(coordinates: Array) -> Array:
        return _values(build(coordinates), powers, friction, heat_known)

    central = values(at)
    slopes = np.zeros((len(central), len(at)))
    for k in np.flatnonzero(np.diag(covariance) > 0.0):
        step = np.zeros(len(at))
        step[k] = 1e-5
        # Away from zero, which is a bound of some.
        slopes[:, k] = (
            (values(at + step) - values(at - step)) / 2e-5
            if at[k] < 0.0 or at[k] > 1e-4
            else (values(at + step) - central) / 1e-5
        )
    variances = np.maximum(np.einsum("ij,jk,ik->i", slopes, covariance, slopes), 0.0)
    if curved is not None:
        other = _values(curved.model, powers, friction, heat_known, curved=True)
        variances += curved.probability * (other - central) ** 2
    errors = np.sqrt(variances)
    # A quantity is determined when its standard error is below this share of it.
    return tuple(
        Quantity(
            name=name,
            value=float(value),
            unit=unit,
            standard_error=float(error),
            determined=bool(error <= 0.5 * abs(value)),
        )
        for name, unit, value, error in zip(names, units, central, errors, strict=True)
    )


def _ratio_names(model: ThermalModel) -> list[str]:
    return [p.name for p in model.parameters if p.name[0] in "KC" and getattr(model, p.name) > 0.0]


def _names(
    model: ThermalModel, powers: Sequence[float], friction: bool, heat_known: bool
) -> tuple[list[str], list[str]]:
    names, units = [], []
    words = ("time constant",) if len(model.time_constants(0.0)) == 1 else ("slow time constant", "fast time constant")
    for power in powers:
        at = f" at {power:.4g} W" if heat_known else ""
        names += [f"{word}{at}" for word in words]
        units += ["s"] * len(words)
        if friction and power > 0.0:
            names.append(f"friction cold over warm{at}")
            units.append("1")
    if friction and model.alpha < 0.0:
        for name in _ratio_names(model):
            names.append(f"alpha/{name}")
            units.append("1/W" if name[0] == "K" else "1/J" if model.name != "fractional" else "s^(1-nu)/J")
    if not heat_known:
        for name in _ratio_names(model):
            names.append(f"heat/{name}")
            units.append("K" if name[0] == "K" else "K/s")
    return names, units


def _values(
    model: ThermalModel, powers: Sequence[float], friction: bool, heat_known: bool, *, curved: bool = False
) -> Array:
    found: list[float] = []
    for power in powers:
        warm = curved_steady_state(model, power) if curved else float(model.steady_state(power, drives=0.0)[..., 0])
        here = curved_slope(model, warm) if curved else model
        found += here.time_constants(power).tolist()
        if friction and power > 0.0:
            ends = [np.array(T, dtype=float) for T in (model.ambient, warm)]
            factors = [curved_factor(model, T)[0] if curved else model.friction_factor(T) for T in ends]
            found.append(float(factors[0] / factors[1]))
    if friction and model.alpha < 0.0:
        found += [model.alpha / getattr(model, name) for name in _ratio_names(model)]
    if not heat_known:
        found += [model.beta / getattr(model, name) for name in _ratio_names(model)]
    return np.array(found)


def span(channels: NDArray[np.bool_], predicted: Array, info: Information, curved: CurvedFit | None) -> Quantity | None:
    """Computes the largest over the smallest friction factor at the times at which friction was measured.

    Args:
        channels: which measurements are friction (M,).
        predicted: measurements by the fit (M,).
        info: covariance of the coordinates, and sensitivities of the measurements.
        curved: the fit with an exponential fall; None for none.

    Returns:
        The ratio; None without friction.
    """
    if not channels.any() or predicted[channels].min() <= 0.0:
        return None
    rows = np.flatnonzero(channels)
    high, low = rows[np.argmax(predicted[rows])], rows[np.argmin(predicted[rows])]
    value = float(predicted[high] / predicted[low])

    slope = info.sensitivities[high] / predicted[high] - info.sensitivities[low] / predicted[low]
    variance = float(slope @ info.covariance @ slope)
    if curved is not None:
        other = curved.predicted[rows]
        variance += curved.probability * float(np.log(other.max() / other.min() / value)) ** 2
    return Quantity(name=SPAN, value=value, unit="1", standard_error=value * float(np.sqrt(variance)), determined=True)
