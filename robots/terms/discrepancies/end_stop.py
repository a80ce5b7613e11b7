"""A place in a joint's range beyond which something is met: a buffer, a stop, a hose or cable that goes taut."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robots.robot import Robot
from robots.terms.base import force_unit, length_unit
from robots.terms.discrepancies.local_fault import Placed
from robots.terms.effects import Coefficient, Shape, Situation

Array = NDArray[np.float64]

SCANNED = tuple(float(share) for share in np.arange(0.05, 0.96, 0.075))
"""Places of a scan, as shares of the joint's range."""
RANGE = (0.02, 0.98)
"""Shares of it between which one is: what is met before it, or after it, is all or nothing of the data."""


@dataclass(frozen=True)
class EndStop(Placed):
    """tau = (k + d dq) x beyond a place c, x = (q - c) there; or short of it, x = (c - q).

    The stop has a stiffness k and a damping d that grows with the depth, as a rubber buffer has.

    Attributes:
        below: whether it is met at positions short of the place.
    """

    below: bool = False

    shapes = (Shape("place", "rad", -np.inf, np.inf, "linear"),)

    @property
    def name(self) -> str:  # type: ignore[override]
        """A text that `build_pattern` reads."""
        return f"pattern:stop:0:{'below' if self.below else 'above'}"

    @property
    def title(self) -> str:  # type: ignore[override]
        """The effect's title."""
        return f"contact {'below' if self.below else 'above'} a position of the joint"

    def parameters(self, robot: Robot, joint: int | None) -> tuple[Coefficient, ...]:
        """Describes the torque per depth, and per depth and velocity."""
        assert joint is not None
        force, length = force_unit(robot, joint - 1), length_unit(robot, joint - 1)
        return (Coefficient("stiffness", f"{force}/{length}"), Coefficient("damping", f"{force} s/{length}2"))

    def grid(self, situation: Situation, joint: int | None) -> tuple[tuple[float, ...], ...]:
        """Lists places all over the joint's range; none for one that hardly moves."""
        low, reach = self.reach(situation, joint)
        return tuple((low + reach * share,) for share in SCANNED) if reach else ()

    def bounds(self, situation: Situation, joint: int | None) -> tuple[tuple[float, float], ...]:
        """Keeps the place within the joint's range."""
        low, reach = self.reach(situation, joint)
        return ((low + RANGE[0] * reach, low + RANGE[1] * reach),)

    def local(self, situation: Situation, joint: int, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque per unit of the coefficients (N, 2)."""
        deep = np.maximum((situation.q[:, joint - 1] - shape[0]) * (-1.0 if self.below else 1.0), 0.0)
        return np.column_stack([-deep if self.below else deep, deep * situation.dq[:, joint - 1]])

    def describe(
        self,
        joint: int | None,
        coefficients: Array,
        shape: tuple[float, ...] = (),
        *,
        force: str = "N m",
        length: str = "rad",
    ) -> str:
        """Says where it begins and how stiff it is."""
        return (
            f"The residual torque of joint {joint} starts {'below' if self.below else 'above'} {shape[0]:.3g} "
            f"{length} and changes by {coefficients[0]:.3g} {force}/{length} from there. Likely cause: a buffer, an "
            f"end stop, or a tight hose."
        )
