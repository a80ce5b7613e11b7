"""A drive at the end of its current: torque that is cut off."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from robots.terms.effects.base import Coefficient, JointEffect, Place, Shape, Situation

if TYPE_CHECKING:
    from robots.robot import Robot

Array = NDArray[np.float64]


class CurrentClipping(JointEffect):
    """tau = c (clip(tau, -L, L) - tau), c = 1 where all of the torque beyond L is lost.

    The log is cut with its noise, which at the limit is then lost to one side: L comes out low by some share of it.

    Flat tops in the log are also flagged by `gate`: such samples say that the torque was L or more, not how much.
    """

    name: ClassVar[str] = "current_clipping"
    title: ClassVar[str] = "torque cut off at the current limit"
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("level", "N m", 1e-3, 1e6, "log", inexact=0.01),)
    rivals: ClassVar[tuple[str, ...]] = ("torque_constant_saturation", "load_dependent_friction")
    experiments: ClassVar[tuple[str, ...]] = ("payload", "static_hold")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the share that is lost."""
        return (Coefficient("share_lost", "1", 0.0, 2.0),)

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists levels that 1 to 40 % of the samples exceed."""
        assert joint is not None
        size = np.abs(situation.torque[:, joint - 1])
        levels = np.quantile(size, (0.6, 0.7, 0.8, 0.875, 0.925, 0.96, 0.98, 0.99))
        return tuple((float(level),) for level in np.unique(levels) if 1e-3 < level < size.max())

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Keeps the level below the largest torque."""
        assert joint is not None
        top = float(np.abs(situation.torque[:, joint - 1]).max(initial=0.0))
        return ((max(0.2 * top, 1e-3), max(top, 2e-3)),)

    def local(self, situation: Situation, joint: int, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates what the cut takes away."""
        torque = situation.torque[:, joint - 1]
        return (np.clip(torque, -shape[0], shape[0]) - torque)[:, None]

    def gate(self, situation: Situation, joint: Place, measured: Array) -> NDArray[np.bool_]:
        """Flags flat tops: three and more samples in a row at the largest torque of the log, thirty in all."""
        assert joint is not None
        flagged = np.zeros(measured.shape, dtype=bool)
        size = np.abs(measured[:, joint - 1])
        at_top = size >= (1.0 - FLAT) * size.max(initial=0.0)
        if at_top.sum() < FLAT_SAMPLES or not size.any():
            return flagged
        for run in situation.runs:
            part = at_top[run]
            edges = np.flatnonzero(np.diff(np.concatenate([[0], part.astype(int), [0]])))
            for first, last in zip(edges[::2], edges[1::2], strict=True):
                if last - first >= 3:
                    flagged[run.start + first : run.start + last, joint - 1] = True
        return flagged if flagged.sum() >= FLAT_SAMPLES else np.zeros_like(flagged)

    def describe(
        self,
        joint: Place,
        coefficients: Array,
        shape: tuple[float, ...] = (),
        *,
        force: str = "N m",
        length: str = "rad",
    ) -> str:
        """Says what the values mean."""
        return f"The torque of joint {joint} is cut off at {shape[0]:.4g} {force}: the drive's current is at its limit."

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Gives the base model's torque."""
        assert joint is not None
        return f"torque of joint {joint} by the base model [N m]", situation.torque[:, joint - 1]


FLAT = 1e-4
"""Relative difference from the largest torque up to which a sample is at it."""
FLAT_SAMPLES = 30
