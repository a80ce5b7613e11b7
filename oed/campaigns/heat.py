"""Friction power of a campaign, its heat, and the temperatures to expect."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from oed.campaigns.stages import Stage
from oed.campaigns.timetable import Slot
from robots.common.arrays import Array
from robots.robot import Robot
from robots.thermal import KnownThermal
from robots.thermal import friction_power as power_of

POWER_BIN = 5.0
"""Time over which the friction power is averaged [s]: short against the fastest time constant, some two minutes."""


def friction_power(robot: Robot, dq: ArrayLike) -> Array:
    """Power that the described friction takes: f1 |dq| + f2 dq^2 + f3 |dq|^3 + f4 dq^4 (thesis eq. 96).

    Args:
        robot: the robot.
        dq: joint velocities, (N, n) [rad/s or m/s].

    Returns:
        (N, n) [W].
    """
    return power_of(dq, robot.friction)


def stage_heat(robot: Robot, stage: Stage) -> Array:
    """Heat of a stage in each joint by the described friction, (n,) [J]: each sample counts for one period."""
    heat: Array = friction_power(robot, stage.motion.dq).sum(axis=0) * robot.period
    return heat


def binned_power(robot: Robot, stage: Stage) -> tuple[Array, Array]:
    """Averages the friction power of a stage over short times.

    Returns:
        The lengths of the bins, (B,) [s], and the mean power in each, (B, n) [W]; their products sum to the heat.
    """
    power = friction_power(robot, stage.motion.dq)
    bins = max(1, round(stage.duration / POWER_BIN))
    edges = np.linspace(0, len(power), bins + 1).astype(np.int64)
    counts = np.diff(edges)
    return counts * robot.period, np.add.reduceat(power, edges[:-1], axis=0) / counts[:, None]


@dataclass(frozen=True, kw_only=True, eq=False)
class Temperatures:
    """Temperatures that the thermal model expects.

    Args:
        t: on the campaign's clock, (M,) [s].
        T1: where the heat is produced, (M, n) [degC].
        T2: around it, (M, n) [degC].
    """

    t: Array
    T1: Array
    T2: Array

    def at(self, times: ArrayLike) -> tuple[Array, Array]:
        """Interpolates the temperatures.

        Args:
            times: (K,) [s].

        Returns:
            T1 and T2, (K, n) each [degC].
        """
        t = np.asarray(times, dtype=np.float64)
        first, second = (
            np.stack([np.interp(t, self.t, column) for column in values.T], axis=-1) for values in (self.T1, self.T2)
        )
        return first, second


def expected_temperatures(
    robot: Robot,
    stages: Mapping[str, Stage],
    slots: Sequence[Slot],
    thermal: KnownThermal,
    *,
    cold_friction: float = 1.0,
) -> Temperatures:
    """Follows each joint through the campaign, from ambient temperature.

    Args:
        robot: its described friction gives the power.
        stages: by name.
        slots: the timetable.
        thermal: of each joint.
        cold_friction: friction of the cold robot over that of the description.

    Returns:
        The temperatures at the ends of all bins.
    """
    binned = {name: binned_power(robot, stage) for name, stage in stages.items()}
    steps: list[Array] = []
    powers: list[Array] = []
    for slot in slots:
        if slot.stage is not None:
            lengths, power = binned[slot.stage]
        else:
            bins = max(1, round(slot.duration / POWER_BIN))
            lengths, power = np.full(bins, slot.duration / bins), np.zeros((bins, robot.n))
        steps.append(lengths)
        powers.append(power)
    h, W = np.concatenate(steps), cold_friction * np.concatenate(powers)
    # A polynomial fitted to data may dip below zero where there were none; friction never gives power back.
    W = np.maximum(W, 0.0)
    paths = np.stack([model.temperatures(W[:, j], h) for j, model in enumerate(thermal.models)], axis=1)  # (M, n, 2)
    return Temperatures(t=np.concatenate([[0.0], np.cumsum(h)]), T1=paths[:, :, 0], T2=paths[:, :, 1])
