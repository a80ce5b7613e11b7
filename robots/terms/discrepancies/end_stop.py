"""A contact beyond a position of a joint: a buffer, an end stop, or a hose or cable that becomes taut."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robots.common.arrays import Array
from robots.robot import Robot
from robots.terms.base import force_unit, length_unit
from robots.terms.columns import side_by_side
from robots.terms.discrepancies.local_fault import Placed
from robots.terms.effects import Coefficient, Shape, Situation

SCANNED = tuple(float(share) for share in np.arange(0.05, 0.96, 0.075))
"""Positions of a scan, as fractions of the joint's range in the data."""
RANGE = (0.02, 0.98)
"""Least and largest position of the contact, as fractions of that range; outside, all or no data show the contact."""


@dataclass(frozen=True)
class EndStop(Placed):
    """tau = k x + d |x| dq with x = max(q - c, 0), or x = min(q - c, 0) for a contact below c.

    The contact begins at the position c. It has a stiffness k and, like a rubber buffer, a damping that grows with the
    depth.

    Attributes:
        below: whether the contact is below the position c.
    """

    below: bool = False

    shapes = (Shape("place", "rad", -np.inf, np.inf, "linear"),)

    @property
    def name(self) -> str:  # type: ignore[override]
        """The effect's name, which `build_pattern` reads."""
        return f"pattern:stop:0:{'below' if self.below else 'above'}"

    @property
    def title(self) -> str:  # type: ignore[override]
        """The effect's title in reports."""
        return f"contact {'below' if self.below else 'above'} a position of the joint"

    def parameters(self, robot: Robot, joint: int | None) -> tuple[Coefficient, ...]:
        """Describes stiffness and damping."""
        assert joint is not None
        force, length = force_unit(robot, joint - 1), length_unit(robot, joint - 1)
        return (Coefficient("stiffness", f"{force}/{length}"), Coefficient("damping", f"{force} s/{length}2"))

    def grid(self, situation: Situation, joint: int | None) -> tuple[tuple[float, ...], ...]:
        """Lists positions over the joint's range; empty if the joint hardly moves."""
        low, reach = self.reach(situation, joint)
        return tuple((low + reach * share,) for share in SCANNED) if reach else ()

    def bounds(self, situation: Situation, joint: int | None) -> tuple[tuple[float, float], ...]:
        """Bounds the position to the joint's range."""
        low, reach = self.reach(situation, joint)
        return ((low + RANGE[0] * reach, low + RANGE[1] * reach),)

    def local(self, situation: Situation, joint: int, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque per unit of the coefficients (N, 2)."""
        deep = np.maximum((situation.q[:, joint - 1] - shape[0]) * (-1.0 if self.below else 1.0), 0.0)
        return side_by_side([-deep if self.below else deep, deep * situation.dq[:, joint - 1]])

    def describe(
        self,
        joint: int | None,
        coefficients: Array,
        shape: tuple[float, ...] = (),
        *,
        force: str = "N m",
        length: str = "rad",
    ) -> str:
        """Describes position and stiffness of the contact."""
        return (
            f"The residual torque of joint {joint} starts {'below' if self.below else 'above'} {shape[0]:.3g} "
            f"{length} and changes by {coefficients[0]:.3g} {force}/{length} from there. Likely cause: a buffer, an "
            f"end stop, or a tight hose."
        )
