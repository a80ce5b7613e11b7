"""What can be chosen of an identification of drives."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from robots.common.options import Option, Seed, names


@dataclass(frozen=True, kw_only=True)
class FitOptions:
    """Settings of the fit.

    Attributes:
        iterations: the most Gauss-Newton steps of a round.
        rounds: how often the joints' weights are taken from their errors.
        settled: relative decrease of the cost below which the fit has settled; a finer fit follows.
    """

    iterations: int = 25
    rounds: int = 2
    settled: float = 1e-4


@dataclass(frozen=True, kw_only=True)
class ActuatorOptions:
    """Settings of `identify_actuators`.

    Attributes:
        share: parts of joint names, comma-separated, whose joints share parameters: hip,thigh,calf; or all.
        free: parameters to identify beside delay, armature, friction and offset, comma-separated: kp,kd.
        effects: look for effects beyond these.
        fit: settings of the fits.
        seed: seed of the random numbers.
    """

    share: Annotated[tuple[str, ...], Option(reads=names)] = ()
    free: Annotated[tuple[str, ...], Option(reads=names)] = ()
    effects: bool = True
    fit: Annotated[FitOptions, Option(hidden=True)] = field(default_factory=FitOptions)
    seed: Seed = 0
