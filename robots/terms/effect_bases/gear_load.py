"""What gears bear besides the robot's own weight and inertia: springs, payloads, pushes, a base that is not level."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from robots.terms.effect_bases.base import Effect, Place
from robots.terms.situations.situation import Situation

Array = NDArray[np.float64]

LoadPath = Literal["effects", "preloads"]
"""Torque of effects that load the gear: alone, or with the base model's offset on joints that they preload."""


@dataclass(frozen=True, eq=False)
class LoadSource:
    """An effect whose torque gears bear.

    Attributes:
        effect: one that is `loads_gear`.
        joint: where it acts, counted from 1; None for the whole robot.
        shape: values of its shape parameters.
        coefficients: of its columns (k,).
    """

    effect: Effect
    joint: Place
    shape: tuple[float, ...]
    coefficients: Array


@dataclass(frozen=True, eq=False)
class ExtraGearLoad:
    """What effects add to the load of gears, beside the base parameters that they were fitted with.

    What of a spring resembles gravity the base model may have taken, and the load with it: both together are what the
    gear bears, whichever has how much of it.

    Attributes:
        path: what of them the gears bear.
        sources: the effects.
    """

    path: LoadPath
    sources: Sequence[LoadSource]

    def on(self, now: Situation) -> Situation:
        """Gives what effects that grow with the load depend on."""
        borne = np.zeros_like(now.q)
        for weight in self.sources:
            borne += weight.effect.columns(now, weight.joint, weight.shape) @ weight.coefficients
        if self.path == "preloads":
            held = sorted({w.joint - 1 for w in self.sources if w.effect.preloads and w.joint is not None})
            borne[:, held] += (now.torque - now.rigid - now.friction)[:, held]
        return now.bearing(borne)


def with_gear_load(now: Situation, bearing: ExtraGearLoad | None) -> Situation:
    """Gives what effects that grow with the load depend on, whether gears bear anything else or not."""
    return now if bearing is None else bearing.on(now)
