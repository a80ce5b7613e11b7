"""Gear load in addition to the robot's own weight and inertia: springs, payloads, contacts, a tilted base."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from robots.common.arrays import Array
from robots.terms.effect_bases.base import Effect, Place
from robots.terms.effect_bases.capabilities import GearLoad
from robots.terms.situations.situation import Situation

LoadPath = Literal["effects", "preloads"]
"""Which torque loads the gears: that of the effects alone, or also the base model's offset on preloaded joints."""


@dataclass(frozen=True, eq=False)
class LoadSource:
    """An effect whose torque loads the gears.

    Attributes:
        effect: an effect with `loads_gear`.
        joint: where it acts, counted from 1; None for the whole robot.
        shape: values of its shape parameters.
        coefficients: coefficients of its columns (k,).
    """

    ENTRIES = ("effect=effect.name", "joint", "shape", "coefficients")

    effect: Effect
    joint: Place
    shape: tuple[float, ...]
    coefficients: Array


@dataclass(frozen=True, eq=False)
class ExtraGearLoad:
    """Additional gear load by effects that were fitted together with the base parameters.

    Part of a spring's torque resembles gravity and may be in the base model. Only the sum of both is the gear's load.

    Attributes:
        path: which torque loads the gears.
        sources: the effects.
    """

    ENTRIES = ("how=path", "weights=sources")

    path: LoadPath
    sources: Sequence[LoadSource]

    def on(self, now: Situation) -> Situation:
        """Returns the situation with the additional gear load, for load-dependent effects."""
        load = np.zeros_like(now.q)
        for weight in self.sources:
            load += weight.effect.columns(now, weight.joint, weight.shape) @ weight.coefficients
        if self.path == "preloads":
            preloaded = sorted(
                {w.joint - 1 for w in self.sources if w.effect.gear_load is GearLoad.PRELOADS and w.joint is not None}
            )
            load[:, preloaded] += (now.torque - now.rigid - now.friction)[:, preloaded]
        return now.bearing(load)


def with_gear_load(now: Situation, bearing: ExtraGearLoad | None) -> Situation:
    """Returns the situation with an additional gear load; unchanged if `bearing` is None."""
    return now if bearing is None else bearing.on(now)
