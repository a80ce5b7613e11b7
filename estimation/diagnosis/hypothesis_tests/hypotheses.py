"""Hypotheses: one effect at one joint, or on the whole robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimation.diagnosis.noise_models.whitening import acting
from robots.common.arrays import Array
from robots.robot import Robot
from robots.terms.effects import Effect, JointEffect, Situation


@dataclass(frozen=True)
class Hypothesis:
    """One effect at one joint, or on the whole robot.

    Attributes:
        effect: the effect.
        joint: counted from 1; None for the whole robot.
    """

    effect: Effect
    joint: int | None

    @property
    def name(self) -> str:
        """The effect's name."""
        return self.effect.name

    @property
    def label(self) -> str:
        """Effect and joint, for logs and messages."""
        return self.name if self.joint is None else f"{self.name} of joint {self.joint}"

    def columns(self, situation: Situation, shape: tuple[float, ...]) -> tuple[tuple[int, ...], tuple[Array, ...]]:
        """Evaluates the columns (N, k) on each joint, from 0, on which they are not all zero.

        Args:
            situation: inputs of the effect (N samples).
            shape: values of its shape parameters.

        Returns:
            The joints, from 0, and the columns (N, k) of each [N m or N per unit of the coefficient].
        """
        if self.effect.needs_full_rate and situation.full_rate is not None:
            joints, parts = self.columns(situation.full_rate.situation, shape)
            return joints, tuple(situation.full_rate.thinned(part) for part in parts)
        if isinstance(self.effect, JointEffect) and self.joint is not None:
            return (self.joint - 1,), (_finite(self.effect.local(situation, self.joint, shape)),)
        X = _finite(self.effect.columns(situation, self.joint, shape))
        joints = tuple(int(j) for j in np.flatnonzero(acting(X).any(axis=1))) or (0,)
        return joints, tuple(X[:, j] for j in joints)

    def dense(self, situation: Situation, shape: tuple[float, ...]) -> Array:
        """Evaluates the columns on all joints (N, n, k), zero where it does not act; see `columns`."""
        joints, columns = self.columns(situation, shape)
        X = np.zeros((*situation.q.shape, columns[0].shape[1]))
        for j, part in zip(joints, columns, strict=True):
            X[:, j] = part
        return X

    def coefficient_bounds(self, robot: Robot, shape: tuple[float, ...]) -> tuple[Array, Array]:
        """Returns the physical bounds of the coefficients, (k,) and (k,), at given shape values."""
        ranges = self.effect.ranges(robot, self.joint, shape)
        return np.array([lower for lower, _ in ranges]), np.array([upper for _, upper in ranges])


def all_hypotheses(robot: Robot, effects: Sequence[Effect]) -> tuple[Hypothesis, ...]:
    """Lists each effect at each joint where it can act."""
    return tuple(Hypothesis(effect, joint) for effect in effects for joint in effect.joints(robot))


def _finite(X: Array) -> Array:
    """Sets values that are not finite to zero, and columns whose squares single precision cannot hold."""
    with np.errstate(all="ignore"):
        largest = max(X.max(initial=0.0), -X.min(initial=0.0))
    # A column with larger values, in its unit, is a response that diverges.
    diverged = 1e15
    if largest < diverged:
        return X
    X = np.where(np.isfinite(X), X, 0.0)
    return np.where(np.abs(X).max(axis=0) < diverged, X, 0.0)
