"""Torque that is clipped at the drive's current limit."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from robots.common.arrays import Array
from robots.common.stretches import spans
from robots.terms.base import force_unit
from robots.terms.effect_bases.base import Coefficient, JointEffect, Place, Shape, Situation
from robots.terms.effect_bases.capabilities import Reading

if TYPE_CHECKING:
    from robots.robot import Robot


class CurrentClipping(JointEffect):
    """tau = c (clip(tau, -L, L) - tau), with c = 1 if all torque beyond L is lost.

    The total torque tau includes that of other effects. A drive also clips noise, which is then one-sided at the
    limit. If a log shows L by flat tops, the column is the mean loss including noise; otherwise L is estimated too low.

    `gate` flags flat tops in the log, because such samples give only a lower bound of the torque.
    """

    name: ClassVar[str] = "current_clipping"
    title: ClassVar[str] = "torque limited by the drive current"
    reading: ClassVar[Reading] = Reading.CUTS
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("level", "N m", 1e-3, 1e6, "log", inexact=0.01),)
    rivals: ClassVar[tuple[str, ...]] = ("torque_constant_saturation", "load_dependent_friction")
    experiments: ClassVar[tuple[str, ...]] = ("payload", "static_hold")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the fraction of the torque beyond the level that is lost."""
        return (Coefficient("share_lost", "1", 0.0, 1.0),)

    def ranges(self, robot: Robot, joint: Place, shape: tuple[float, ...]) -> tuple[tuple[float, float], ...]:
        """Bounds the fraction that is lost; a smaller loss has another cause, such as saturation."""
        return ((LEAST_REMOVED_SHARE, 1.0),)

    def is_plausible(self, robot: Robot, joint: Place, coefficients: Array, shape: tuple[float, ...] = ()) -> bool:
        """Returns whether most of the torque is lost, at a level that a drive of the joint's rating may have.

        The upper limit of the share, one, is the expected value.
        """
        rating = 0.0 if joint is None else float(robot.limits.torque[joint - 1])
        # Least level as a share of the joint's rated torque.
        weak = bool(shape) and np.isfinite(rating) and shape[0] < 0.05 * rating
        return float(coefficients[0]) > LEAST_REMOVED_SHARE and not weak

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists levels that 0.15 to 40 % of the samples exceed, or the largest torque alone if it is a flat top."""
        assert joint is not None
        if flat := self._flat(situation, joint):
            return ((flat,),)
        size = np.abs(situation.whole[:, joint - 1])
        levels = np.quantile(size, (0.6, 0.7, 0.8, 0.875, 0.925, 0.96, 0.98, 0.99, 0.996, 0.9985))
        least = self._least(situation, joint)
        return tuple((float(level),) for level in np.unique(levels) if least < level < size.max())

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Bounds the level by the largest torque, or fixes it at the log's flat top."""
        assert joint is not None
        top = float(np.abs(situation.whole[:, joint - 1]).max(initial=0.0))
        flat = self._flat(situation, joint)
        least = max(0.2 * top, self._least(situation, joint))
        return ((flat, flat),) if flat else ((least, max(top, 2 * least)),)

    def _least(self, situation: Situation, joint: int) -> float:
        """Returns the lowest level that the logged torque allows: noise aside, a drive delivers no more than it."""
        if situation.measured is None:
            return 1e-3
        # Noise may lift 2 % of the logged torques above the level, by a fifth.
        return max(1e-3, float(np.quantile(np.abs(situation.measured[:, joint - 1]), 0.98)) / 1.2)

    def _flat(self, situation: Situation, joint: int) -> float:
        """Returns the log's largest torque if it is a flat top that the modelled torque approaches, else zero."""
        measured = situation.measured
        if measured is None or self.chance(situation, joint, measured) >= FLAT_TOP_CHANCE:
            return 0.0
        return float(np.abs(measured[:, joint - 1]).max())

    def local(self, situation: Situation, joint: int, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque that the limit removes (N, 1); with flat tops, its mean over the noise."""
        torque, level = situation.whole[:, joint - 1], shape[0]
        lost = np.clip(torque, -level, level) - torque
        if self._flat(situation, joint):
            assert situation.measured is not None
            noise = _spread(situation.measured[:, joint - 1] - torque, np.abs(torque) < level)
            lost += _above(-torque - level, noise) - _above(torque - level, noise)
        return lost[:, None]

    def gate(self, situation: Situation, joint: Place, measured: Array) -> NDArray[np.bool_]:
        """Flags flat tops: three or more consecutive samples at the log's largest torque.

        None are flagged unless there are at least thirty samples, or chance is unlikely to produce them.
        """
        assert joint is not None
        flagged = np.zeros(measured.shape, dtype=bool)
        size = np.abs(measured[:, joint - 1])
        # Relative distance from the largest torque within which a sample is at it.
        for start, stop in _stretches(situation, size >= (1.0 - 1e-4) * size.max(initial=0.0)):
            flagged[start:stop, joint - 1] = True
        # Number of samples in flat tops above which they count without a test against chance.
        certain = flagged.sum() >= 30 or _accident(situation, joint, measured) < FLAT_TOP_CHANCE
        return flagged if certain and size.any() else np.zeros_like(flagged)

    def chance(self, situation: Situation, joint: Place, measured: Array) -> float:
        """Returns the probability of the log's flat tops by chance; 1 if the modelled torque does not approach them."""
        assert joint is not None
        most, known = (float(np.abs(x[:, joint - 1]).max(initial=0.0)) for x in (measured, situation.whole))
        # Fraction of a flat top that the modelled torque must reach.
        return _accident(situation, joint, measured) if known > 0.9 * most else 1.0

    def describe(
        self,
        joint: Place,
        coefficients: Array,
        shape: tuple[float, ...] = (),
        *,
        force: str = "N m",
        length: str = "rad",
    ) -> str:
        """Describes the values in one sentence."""
        return f"The torque of joint {joint} is limited to {shape[0]:.3g} {force}, the drive's current limit."

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Returns the torque before clipping."""
        assert joint is not None
        name = "the base model" if situation.beyond is None else "the model without a limit"
        unit = force_unit(situation.robot, joint - 1)
        return f"torque of joint {joint} by {name} [{unit}]", situation.whole[:, joint - 1]


LEAST_REMOVED_SHARE = 0.5
"""Least fraction of the torque beyond the level that a limit removes; the true value is one."""
FLAT_TOP_CHANCE = 1e-6
"""Probability below which flat tops are not by chance."""


def _stretches(situation: Situation, flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Lists the ranges [start, stop) of three or more consecutive flagged rows (N,) within one log."""
    parts = ((run.start, spans(flags[run])) for run in situation.runs)
    return [(first + a, first + b) for first, part in parts for a, b in part if b - a >= 3]


def _spread(values: Array, counted: NDArray[np.bool_]) -> float:
    """Estimates a robust standard deviation of the values at counted rows."""
    return 1.4826 * float(np.median(np.abs(values[counted]))) if counted.any() else 0.0


def _above(excess: Array, noise: float) -> Array:
    """Computes the mean extra torque (N,) that clipping removes because of normal noise, per excess over the level."""
    if noise <= 0:
        return np.zeros_like(excess)
    z = -np.abs(excess) / noise
    return np.asarray(noise * (np.exp(-0.5 * z**2) / np.sqrt(2 * np.pi) + z * ndtr(z)))


def _accident(situation: Situation, joint: int, measured: Array) -> float:
    """Computes the probability of as many runs of three or more samples at the largest torque by chance.

    The reference is the frequency of runs of equal values elsewhere. A coarse torque resolution causes many of them.
    """
    # Difference between two samples, relative to the largest torque, below which they are equal.
    tie = 1e-6

    def evaluate() -> float:
        torque = measured[:, joint - 1]
        top = np.abs(torque) >= (1.0 - tie) * np.abs(torque).max(initial=0.0)
        alike = np.abs(np.diff(torque)) <= tie * np.abs(torque).max(initial=0.0)
        still = np.concatenate([[False], alike]) | np.concatenate([alike, [False]])
        others = sum(stop - start for start, stop in _stretches(situation, still & ~top))
        return float(((1.0 + others) / (1.0 + np.sum(~top))) ** len(_stretches(situation, still & top)))

    return situation.cached(("flat top", joint), evaluate) if measured is situation.measured else evaluate()
