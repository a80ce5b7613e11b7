"""What can be chosen of a thermal identification."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from robots.common.errors import InputError
from robots.common.options import Option, Seed


@dataclass(frozen=True, kw_only=True)
class ThermalOptions:
    """Choices of `identify_thermal`.

    Attributes:
        order: thermal model: 1, 2, advanced, fractional, or auto to compare them.
        joint: joint for the model comparison and the duty-cycle figure. Default: the joint with the largest friction
            power.
        alpha: known relative change of friction with temperature [1/K], negative.
        ambient: ambient temperature of logs that do not state it [degC].
        friction: friction model: auto (bends within the recorded speeds, grows linearly beyond), polynomial
            (four coefficients a joint) or coulomb-viscous (two).
        seed: seed of the random numbers.

    Raises:
        InputError: an alpha that is not negative.
    """

    order: str = "2"
    joint: Annotated[int | None, Option(least=1)] = None
    alpha: float | None = None
    ambient: float | None = None
    friction: str = "auto"
    seed: Seed = 0

    def __post_init__(self) -> None:
        if self.alpha is not None and not (math.isfinite(self.alpha) and self.alpha < 0.0):
            raise InputError(
                f"--alpha {self.alpha}", allowed="a negative number, because friction falls as a joint warms up"
            )
