"""`oed.design` with its options side by side, for tests that try many of them."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import oed
from oed.experiments import Design

GROUPS = {
    "model": oed.ModelOptions,
    "trajectory": oed.TrajectoryOptions,
    "limits": oed.LimitOptions,
    "weights": oed.WeightOptions,
    "search": oed.SearchOptions,
}


def grouped(**options: Any) -> dict[str, Any]:
    """The option objects of `oed.design` for options by their own names; `harmonics` and the like size a series."""
    series = {key: options.pop(key) for key in ("harmonics", "base_frequency") if key in options}
    if series:
        options["family"] = oed.Fourier(**series)
    made = {}
    for name, kind in GROUPS.items():
        own = {field.name: options.pop(field.name) for field in fields(kind) if field.name in options}
        if own:
            made[name] = kind(**own)
    return options | made


def design(robot: Any, **options: Any) -> Design:
    """Designs with options by their own names, at full speed also for the robots that the tests make."""
    return oed.design(robot, **grouped(**{"velocity_fraction": 1.0, **options}))
