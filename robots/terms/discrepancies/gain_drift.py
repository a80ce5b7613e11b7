"""A common gain of all joints' torque signals that drifts, for example with the supply or a common reference."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from robots.common.arrays import Array
from robots.common.plain import percent
from robots.robot import Robot
from robots.terms.columns import side_by_side
from robots.terms.effect_bases.capabilities import Persistence
from robots.terms.effects import Coefficient, Effect, Situation

GAIN_WAVES = 5
FEWEST_JOINTS_OF_DRIFT = 3  # joints


class OverTime(Effect):
    """Base class of changes over time that all joints share."""

    whole_robot: ClassVar[bool] = True
    persistence: ClassVar[Persistence] = Persistence.TIME

    def joints(self, robot: Robot) -> tuple[int | None, ...]:
        """Returns the whole robot if it has at least three joints; with fewer, a common change is not distinct."""
        return (None,) if robot.n >= FEWEST_JOINTS_OF_DRIFT else ()


class GainDrift(OverTime):
    """tau_e,j = tau_j g(t) on every joint j, g smooth in time: k half cosine waves over the logs, k = 1 ... KNOTS.

    The temperature dependence of a torque constant differs between joints; see `torque_constant_heat`.
    """

    name: ClassVar[str] = "pattern:fading:0:even"
    title: ClassVar[str] = "common gain drift of all torque signals"

    def parameters(self, robot: Robot, joint: int | None) -> tuple[Coefficient, ...]:
        """Describes the relative amplitude of each half wave."""
        return tuple(Coefficient(f"share_{k}", "1") for k in range(1, GAIN_WAVES + 1))

    def columns(self, situation: Situation, joint: int | None, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the base model's torque times each half wave (N, n, KNOTS)."""
        return np.asarray(situation.torque[:, :, None] * half_waves(log_time(situation))[:, None])

    def describe(
        self,
        joint: int | None,
        coefficients: Array,
        shape: tuple[float, ...] = (),
        *,
        force: str = "N m",
        length: str = "rad",
    ) -> str:
        """Describes the finding in one sentence."""
        share = half_waves(np.linspace(0.0, 1.0, 201)) @ coefficients
        return (
            "The torque signals of all joints change slowly with time by the same factor; the total change over the "
            "logs is "
            f"{percent(float(np.ptp(share)))}. Likely cause: the supply, or a common reference of the amplifiers."
        )


def half_waves(x: Array, count: int = GAIN_WAVES) -> Array:
    """Evaluates the half cosine waves cos(pi k x), k = 1 ... count (N, count), of relative time x (N,) from 0 to 1."""
    return side_by_side([np.cos(np.pi * k * x) for k in range(1, count + 1)])


def log_time(situation: Situation) -> Array:
    """Returns relative time (N,), from 0 at the first row to 1 at the last."""
    return (situation.t - situation.t[0]) / max(float(situation.t[-1] - situation.t[0]), 1e-9)
