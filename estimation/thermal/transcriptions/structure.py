"""Parameters that a set of runs can determine: which are searched, which are conventions, and why."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.thermal.runs.thermal_run import ThermalRun
from robots.common.errors import InputError, NotIdentifiableError
from robots.thermal import ThermalModel


@dataclass(frozen=True, kw_only=True)
class Structure:
    """Searched and fixed parameters.

    Attributes:
        fixed: values of the parameters that are not searched.
        conventions: those among them that stand for what the data do not determine.
        scaled: parameters that mean something only together with a convention.
        notes: assumptions and limitations.
    """

    fixed: Mapping[str, float]
    conventions: tuple[str, ...]
    scaled: tuple[str, ...]
    notes: tuple[str, ...]


def find_structure(
    kind: type[ThermalModel], runs: Sequence[ThermalRun], alpha: float | None, fixed: Mapping[str, float]
) -> Structure:
    """Decides what to search.

    Args:
        kind: the thermal model.
        runs: the data.
        alpha: a slope of the friction that is known [1/K].
        fixed: other parameters that are known.

    Raises:
        InputError: a fixed parameter that the model does not have, or out of range.
        NotIdentifiableError: no power in any run, or only constant friction.
    """
    known, notes = _checked(kind, alpha, fixed), []
    conventions: list[str] = []
    thermometer = any(run.readings(kind) for run in runs)
    heat_known = any(run.power is not None for run in runs)
    if any(run.power is None for run in runs) and heat_known:
        raise InputError(
            "some runs have a power and some have none",
            column="power",
            allowed="all or none",
            remedy="fit them separately",
        )
    if not any(run.has_friction for run in runs):
        # Without friction data, its slope acts only through the heat, where it is equivalent to a heat exchange.
        if "alpha" not in known:
            known["alpha"] = 0.0
            notes.append(
                "No friction was measured, so alpha is unknown. The friction power is assumed to be independent of "
                "temperature."
            )
        if heat_known:
            # Heat, exchanges and capacities scale together: the power is taken at its word.
            known.setdefault("beta", 1.0)
        else:
            notes.append("The heating power is unknown and assumed constant. Only ratios to it are determined.")
        name = next(p.name for p in kind.parameters if p.name.startswith("C"))
        if not heat_known and name not in known:
            known[name] = next(p.typical for p in kind.parameters if p.name == name)
            conventions.append(name)
    elif "alpha" not in known and not thermometer and not _surroundings_change(runs):
        known["alpha"] = -0.01
        conventions.append("alpha")
        notes.append(
            "Without a measured temperature, only the ratios of alpha to heat exchanges and capacities are "
            "determined. The values hold for an assumed alpha of -0.01 1/K."
        )
    if heat_known and not any(run.heating.any() for run in runs if run.power is not None):
        raise NotIdentifiableError("the joint does not move in any run", remedy="record a run that heats the joint")
    if heat_known and all(_still(run) for run in runs):
        raise NotIdentifiableError("the joint does not move in any run", remedy="record a run that heats the joint")
    names = {p.name for p in kind.parameters}
    if "W_e" in names and "W_e" not in known and not any(np.any(np.asarray(run.drives) > 0) for run in runs):
        known["W_e"] = 0.0
        notes.append("The drives were never powered, so the motor's heat is zero.")
    for name in ("K13", "K23"):
        if name in names and name not in known and not any(run.T3 is not None for run in runs):
            known[name] = 0.0
    scaled = tuple(
        p.name
        for p in kind.parameters
        if conventions and p.name not in known and (p.name[0] in "KC" or (p.name in ("beta", "W_e") and not heat_known))
    )
    return Structure(fixed=known, conventions=tuple(conventions), scaled=scaled, notes=tuple(notes + _coverage(runs)))


def _checked(kind: type[ThermalModel], alpha: float | None, fixed: Mapping[str, float]) -> dict[str, float]:
    known = dict(fixed) if alpha is None else {**fixed, "alpha": alpha}
    by_name = {p.name: p for p in kind.parameters}
    for name, value in known.items():
        if name not in by_name:
            raise InputError(f"the {kind.name} model has no parameter {name}", allowed=", ".join(by_name))
        parameter = by_name[name]
        if not parameter.lower <= value <= parameter.upper:
            raise InputError(
                f"{name} is {value}",
                column=name,
                allowed=f"{parameter.lower:g} to {parameter.upper:g} {parameter.unit}",
            )
    return {name: float(value) for name, value in known.items()}


def _surroundings_change(runs: Sequence[ThermalRun]) -> bool:
    seen = [np.asarray(run.ambient) for run in runs if run.ambient is not None]
    # Surroundings that differ by less [K] between the runs say nothing of the slope of the friction.
    return bool(seen) and float(np.nanmax(np.concatenate(seen)) - np.nanmin(np.concatenate(seen))) >= 2.0


def _still(run: ThermalRun) -> bool:
    return run.power is not None and float(run.held_power.max()) <= 1e-6


def _cooled(run: ThermalRun, seen: NDArray[np.bool_]) -> bool:
    """Whether something was measured after a long rest of a joint that had been under power."""
    # At rest a joint has at most 5 % of its largest power.
    quiet = run.held_power <= 0.05 * float(run.held_power.max())
    warmed, rested = False, 0.0
    for step, rests, known in zip(np.diff(run.t), quiet, seen[1:], strict=True):
        rested += float(step) if rests else 0.0
        # A joint has cooled down after two minutes of rest.
        if warmed and rested >= 120.0 and known:
            return True
        if not rests:
            warmed, rested = True, 0.0
    return False


def _coverage(runs: Sequence[ThermalRun]) -> list[str]:
    notes = []
    measured = [np.isfinite(run.ratio) | _any_reading(run) for run in runs]
    if runs[0].power is not None and not any(
        (~run.heating & seen).any() or _cooled(run, seen) for run, seen in zip(runs, measured, strict=True)
    ):
        notes.append(
            "No cooling phase was measured. Heat exchange is distinguished from the falling friction power only by "
            "differences between power levels."
        )
    if any(run.ambient is None for run in runs) and runs[0].power is not None:
        notes.append("The ambient temperature was not measured. It is estimated, starting from T0.")
    return notes


def _any_reading(run: ThermalRun) -> NDArray[np.bool_]:
    found = np.zeros(run.t.shape, dtype=bool)
    for values in run.temperatures.values():
        found |= np.isfinite(values)
    return found
