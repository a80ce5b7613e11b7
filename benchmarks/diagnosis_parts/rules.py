"""Rules of the diagnosis that can be switched off one by one: where each is used, and what it says when it is off."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from estimation.diagnosis import calibration
from estimation.diagnosis.joint_fits.gear_load import NO_GEAR_LOAD

PACKAGE = "estimation.diagnosis."


@dataclass(frozen=True)
class Rule:
    """One rule.

    Attributes:
        places: ``module:function`` inside the diagnosis, wherever the function is imported to.
        off: what takes its place.
        acted: whether a result of the function, with its arguments, differs from that of `off`.
        late: whether it acts after the search alone.
    """

    places: tuple[str, ...]
    off: Callable[..., Any]
    acted: Callable[[Any, tuple[Any, ...]], bool] = lambda result, arguments: True
    late: bool = False


def _yes(*_: Any, **__: Any) -> bool:
    return True


def _no(*_: Any, **__: Any) -> bool:
    return False


def _denied(result: Any, _: Any) -> bool:
    return not result


RULES: dict[str, Rule] = {
    "sure without BIC": Rule(
        ("searches.acceptance:is_certain", "searches.selection:is_certain", "searches.swap_search:is_certain"),
        _no,
        lambda result, _: bool(result),
    ),
    "single shock": Rule(("searches.selection:exceeds_single_shock",), _yes, _denied),
    "leakage of formulas": Rule(("searches.selection:exceeds_leakage",), _yes, _denied),
    "event window": Rule(
        ("searches.selection:refit_event_window",),
        lambda problem, member, beside: member,
        lambda result, arguments: result is not arguments[1],
    ),
    "shapes refined together": Rule(
        ("searches.selection:refine_shapes_jointly",),
        lambda problem, members: list(members),
        lambda _, arguments: len(arguments[1]) > 1,
    ),
    "swaps with rivals": Rule(
        ("searches.selection:refine_with_swaps",), lambda problem, entries, members, p_values, *_: (members, p_values)
    ),
    "second search": Rule(("searches.search:noise_decreased", "searches.search:base_torque_changed"), _no),
    "timing of reversals": Rule(
        ("searches.search:measure_reversal_timing",), lambda *_: None, lambda result, _: result is not None
    ),
    "high band": Rule(("searches.search:build_high_band",), lambda *_: None, lambda result, _: result is not None),
    "bursts out of the noise": Rule(
        ("noise_models.noise_estimate:find_bursts",),
        lambda left, measured, step: np.zeros_like(measured),
        lambda result, _: bool(result.any()),
    ),
    "lines out of the noise": Rule(
        ("noise_models.noise_spectrum:remove_lines", "noise_models.noise_estimate:remove_lines"),
        lambda power, *_: power,
        lambda result, arguments: not np.array_equal(result, arguments[0]),
    ),
    "free functions out of the noise": Rule(("searches.search:build_nuisance_projection",), lambda *_: ()),
    "joints agree (Birge ratio)": Rule(
        ("hypothesis_tests.refinement:_with_scatter",),
        lambda problem, member, accepted: member,
        lambda result, _: result.birge_ratio > 1.05 or result.motion_error_chi2 > 1.0,
    ),
    "reversals agree (Birge ratio)": Rule(
        ("hypothesis_tests.refinement:_reversal_scatter",), lambda *_: 1.0, lambda result, _: result > 1.05
    ),
    "rows at reversals count": Rule(
        ("searches.search:quiet_joints",),
        lambda recording, *_: np.zeros(recording.n, dtype=bool),
        lambda result, _: bool(result.any()),
    ),
    "load of the gears": Rule(
        ("searches.refit:find_gear_load",), lambda *_: NO_GEAR_LOAD, lambda result, _: result is not NO_GEAR_LOAD
    ),
    "cut-off by the base model": Rule(
        ("recordings.log_reading:select_position_cutoff",), lambda *_: np.inf, lambda result, _: np.isfinite(result)
    ),
    "encoder lines at constant speed": Rule(
        ("recordings.log_reading:remove_encoder_lines",),
        lambda q, dq, ddq, *_: (dq, ddq),
        lambda result, arguments: not np.array_equal(result[0], arguments[1]),
    ),
    "plausible parameters": Rule(("validations.name_comparison:_is_plausible",), _yes, _denied, late=True),
    "names against functions in their place": Rule(
        ("validations.name_comparison:_outperformed",), lambda *_: None, lambda result, _: result is not None, late=True
    ),
    "held-out rejection": Rule(("validations.validation:_is_harmful",), _no, lambda result, _: bool(result), late=True),
    "absent from held-out data": Rule(
        ("validations.validation:_without_change",),
        lambda *_: None,
        lambda result, _: result is not None,
        True,
    ),
    "alternatives on held-out data": Rule(
        ("validations.validation:_alternative",), lambda *_: None, lambda result, _: result is not None, True
    ),
}


def _place(text: str) -> tuple[ModuleType, str]:
    module, name = text.split(":")
    return importlib.import_module(PACKAGE + module), name


@contextmanager
def without(rule: Rule) -> Iterator[None]:
    """Switches a rule off meanwhile."""
    kept = [(module, name, getattr(module, name)) for module, name in map(_place, rule.places)]
    try:
        for module, name, _ in kept:
            setattr(module, name, rule.off)
        yield
    finally:
        for module, name, function in kept:
            setattr(module, name, function)


@contextmanager
def watched(acted: set[str]) -> Iterator[None]:
    """Meanwhile notes which rules change something."""
    kept = []

    def watch(key: str, rule: Rule, function: Callable[..., Any]) -> Callable[..., Any]:
        def watching(*arguments: Any, **options: Any) -> Any:
            result = function(*arguments, **options)
            if rule.acted(result, arguments):
                acted.add(key)
            return result

        return watching

    for key, rule in RULES.items():
        for module, name in map(_place, rule.places):
            kept.append((module, name, getattr(module, name)))
            setattr(module, name, watch(key, rule, getattr(module, name)))
    try:
        yield
    finally:
        for module, name, function in reversed(kept):
            setattr(module, name, function)


@contextmanager
def scaled(constant: str, factor: float) -> Iterator[None]:
    """Scales a constant of the calibration meanwhile, in every module that uses it."""
    value = getattr(calibration, constant)
    changed = type(value)(round(value * factor)) if isinstance(value, int) else value * factor
    users = [m for key, m in sys.modules.items() if key.startswith(PACKAGE) and constant in vars(m)]
    try:
        for module in users:
            setattr(module, constant, changed)
        yield
    finally:
        for module in users:
            setattr(module, constant, value)
