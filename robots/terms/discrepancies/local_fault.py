"""A local disturbance at one position of a joint: a damaged tooth, a dented bearing, a cable that catches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robots.common.arrays import Array
from robots.robot import Robot
from robots.terms.base import force_unit
from robots.terms.effects import Coefficient, JointEffect, Shape, Situation

WIDTHS = (0.015, 0.03, 0.06, 0.12)
"""Widths (standard deviations) in a scan, as fractions of the joint's range; narrower ones are ripple, wider ones a
spring."""


class Placed(JointEffect):
    """Base class of effects at a position of a joint's range."""

    def coordinate(self, situation: Situation, joint: int | None, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Returns the position."""
        assert joint is not None
        return f"position of joint {joint} [rad or m]", situation.q[:, joint - 1]

    @staticmethod
    def reach(situation: Situation, joint: int | None) -> tuple[float, float]:
        """Returns the lower end and the extent of a joint's range in the data; zeros if it hardly moves."""
        assert joint is not None
        q = situation.q[:, joint - 1]
        reach = float(np.ptp(q)) if len(q) else 0.0
        return (float(q.min()), reach) if reach > 1e-3 else (0.0, 0.0)


@dataclass(frozen=True)
class LocalFault(Placed):
    """tau = c exp(-((q - centre) / width)^2 / 2), times the velocity's sign if it is friction.

    Attributes:
        odd: whether it changes sign with the direction of motion.
    """

    odd: bool = False

    shapes = (
        Shape("centre", "rad", -np.inf, np.inf),
        Shape("width", "rad", 0.0, np.inf, "log"),
    )

    @property
    def name(self) -> str:  # type: ignore[override]
        """The effect's name, which `build_pattern` reads."""
        return f"pattern:spot:0:{'odd' if self.odd else 'even'}"

    @property
    def title(self) -> str:  # type: ignore[override]
        """The effect's title in reports."""
        return f"local {'friction' if self.odd else 'torque'} at one position of the joint"

    def parameters(self, robot: Robot, joint: int | None) -> tuple[Coefficient, ...]:
        """Describes the torque at the centre."""
        assert joint is not None
        return (Coefficient("peak", force_unit(robot, joint - 1)),)

    def grid(self, situation: Situation, joint: int | None) -> tuple[tuple[float, ...], ...]:
        """Lists centres over the joint's range, for several widths."""
        low, reach = self.reach(situation, joint)
        if not reach:
            return ()
        # Distance between centres in a scan, in widths.
        return tuple(
            (float(low + reach * place), share * reach)
            for share in WIDTHS
            for place in np.arange(0.0, 1.0 + 1e-9, 1.5 * share)
        )

    def bounds(self, situation: Situation, joint: int | None) -> tuple[tuple[float, float], ...]:
        """Bounds the centre to the joint's range, and the width to fractions of it."""
        low, reach = self.reach(situation, joint)
        # Smallest and largest width, as fractions of the joint's range.
        return (low, low + reach), (0.004 * reach, 0.2 * reach)

    def propose(
        self, situation: Situation, joint: int | None, residual: Array, count: int = 8
    ) -> tuple[tuple[float, ...], ...]:
        """Ranks the grid by the product of the residual with each disturbance, over the disturbance's norm."""
        assert joint is not None
        grid = self.grid(situation, joint)
        if len(grid) <= count:
            return grid
        low, reach = self.reach(situation, joint)
        own = residual[:, joint - 1]
        q = (situation.q[:, joint - 1] - low) / reach
        turned = own * situation.sign[:, joint - 1] if self.odd else own
        # Number of bins over the joint's range for ranking the grid.
        bins = 1000
        place = np.minimum((q * bins).astype(int), bins - 1)
        binned = np.bincount(place, weights=turned, minlength=bins)
        rows = np.bincount(place, weights=own != 0, minlength=bins)
        middles = (np.arange(bins) + 0.5) / bins * reach + low
        centres, widths = np.array(grid).T
        spots = np.exp(-0.5 * ((middles - centres[:, None]) / widths[:, None]) ** 2)
        # A constant is part of the joint's offset, so only the deviation from the mean shows.
        seen = spots - (spots @ rows / max(rows.sum(), 1.0))[:, None]
        size = np.sqrt(np.maximum(seen**2 @ rows, 1e-12))
        return tuple(grid[i] for i in np.argsort(-np.abs(seen @ binned) / size)[:count])

    def local(self, situation: Situation, joint: int, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque per torque at the centre (N, 1)."""
        centre, width = shape
        spot = np.exp(-0.5 * ((situation.q[:, joint - 1] - centre) / max(width, 1e-12)) ** 2)
        return np.asarray((spot * situation.sign[:, joint - 1] if self.odd else spot)[:, None])

    def describe(
        self,
        joint: int | None,
        coefficients: Array,
        shape: tuple[float, ...] = (),
        *,
        force: str = "N m",
        length: str = "rad",
    ) -> str:
        """Describes position, width and size of the disturbance."""
        what = "friction" if self.odd else "torque"
        return (
            f"The residual torque of joint {joint} matches a local disturbance at {shape[0]:.3g} {length}, "
            f"{2 * shape[1]:.2g} {length} wide, with {coefficients[0]:.2g} {force} of {what}."
        )
