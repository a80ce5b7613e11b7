"""Lasting steps during the logs: a base that tilts on its mount, or a joint zero that changes."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from robots.common.arrays import Array
from robots.robot import Robot
from robots.terms.base import length_unit
from robots.terms.effect_bases.states import best_apart
from robots.terms.effect_bases.sudden import Sudden
from robots.terms.effects import Coefficient, Situation
from robots.terms.effects.base_tilt import tilted_torque


class Step(Sudden):
    """Base class of effects on all joints from a time t_c on."""

    # Number of candidate times within the data. Only the best are scanned, because effects on all joints take much
    # memory.
    moments: ClassVar[int] = 64

    def propose(
        self, situation: Situation, joint: int | None, residual: Array, count: int = 8
    ) -> tuple[tuple[float, ...], ...]:
        """Ranks times by the squared product of the residual with the torque after each, over that torque's energy."""
        grid = self.grid(situation, joint)
        if len(grid) <= count:
            return grid
        X = self.columns(situation, joint, (-np.inf,))
        seen = (residual != 0)[:, :, None] * X
        products = np.einsum("tjk,tj->tk", X, residual)
        sums, size = (np.cumsum(x[::-1], axis=0)[::-1] for x in (products, np.einsum("tjk,tjk->tk", seen, seen)))
        rows = np.searchsorted(situation.t, np.ravel(grid))
        # The data after the last candidate times are too short for a fit, so a step's torque counts with 2 % of its
        # energy over all data at least.
        scores = np.sum(sums[rows] ** 2 / np.maximum(size[rows], 0.02 * size[:1] + 1e-300), axis=1)
        # Number of neighbours of a scanned time that are skipped, because the time is refined.
        return tuple(grid[i] for i in best_apart(scores, count, 2))


def _after(columns: Array, situation: Situation, shape: tuple[float, ...]) -> Array:
    """Sets columns (N, n, k) to zero before the change."""
    return np.where((situation.t >= shape[0])[:, None, None], columns, 0.0)


class BaseStep(Step):
    """tau = (d rigid/dg) (g x e_k) a_k from t_c on, e_1 and e_2 horizontal: `base_tilt` that begins within the logs."""

    name: ClassVar[str] = "pattern:base_shift:0:even"
    title: ClassVar[str] = "sudden tilt of the base"
    whole_robot: ClassVar[bool] = True

    def parameters(self, robot: Robot, joint: int | None) -> tuple[Coefficient, ...]:
        """Describes the base's rotations about two horizontal axes."""
        return Coefficient("tilt_1", "rad", -0.5, 0.5), Coefficient("tilt_2", "rad", -0.5, 0.5)

    def joints(self, robot: Robot) -> tuple[int | None, ...]:
        """Returns the whole robot if gravity acts on it, else nothing."""
        return (None,) if np.any(robot.chain.gravity) else ()

    def columns(self, situation: Situation, joint: int | None, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque of all joints per angle (N, n, 2)."""
        return _after(tilted_torque(situation), situation, shape)

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
        angle = np.degrees(np.hypot(*coefficients))
        return (
            f"The residual torque of all joints matches a sudden tilt of the base by {angle:.2g} deg at t = "
            f"{shape[0]:.2f} s, which remains. Likely cause: a loose mount."
        )


class ZeroStep(Step):
    """tau = (d rigid/dq_j) o from t_c on: `encoder_offset` that begins within the logs."""

    name: ClassVar[str] = "pattern:zero_shift:0:even"
    title: ClassVar[str] = "sudden change of a joint zero"

    def parameters(self, robot: Robot, joint: int | None) -> tuple[Coefficient, ...]:
        """Describes the offset."""
        assert joint is not None
        return (Coefficient("offset", length_unit(robot, joint - 1), -0.5, 0.5),)

    def columns(self, situation: Situation, joint: int | None, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque of all joints per offset of one joint (N, n, 1)."""
        assert joint is not None
        return _after(situation.sensitivity("position")[:, :, joint - 1 : joint], situation, shape)

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
        return (
            f"The residual torque matches a joint {joint} that stands {coefficients[0]:.2g} {length} "
            f"further than its encoder says, from t = {shape[0]:.2f} s on. Likely cause: a slipping coupling or a new "
            f"encoder reference."
        )
