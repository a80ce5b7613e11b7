"""A trajectory family of one's own: smooth bumps; each moves a joint for a part of the time.

Run it with ``python family.py``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

import oed
from oed.trajectories import Kinematics


@dataclass(frozen=True, kw_only=True)
class Bumps(oed.Family):
    """q(t) = q0 + sum_k c_k b((t - t_k) / w), with b(x) = (1 - x^2)^4 between -1 and 1, and zero elsewhere.

    Attributes:
        count: number of bumps.
        length: of one repetition [s].
    """

    name: ClassVar[str] = "bumps"
    count: int = 8
    length: float = 10.0

    @classmethod
    def of_size(cls, harmonics: int, base_frequency: float) -> Bumps:
        """Builds the family that the command line's ``--harmonics`` and ``--base-frequency`` ask for."""
        return cls(count=2 * harmonics - 2, length=1 / base_frequency)

    @property
    def size(self) -> int:
        """One coefficient for the pose at both ends, and one for each bump."""
        return self.count + 1

    @property
    def duration(self) -> float:
        """Of one repetition [s]."""
        return self.length

    def basis(self, t: np.ndarray) -> Kinematics:
        """Evaluates one and all bumps (M, K), and three derivatives."""
        spacing = self.length / (self.count + 1)
        # A bump near an end is narrower, so that it is over there.
        place = np.arange(1, self.count + 1)
        width = spacing * np.minimum(1.9, np.minimum(place, place[::-1]))
        x = np.clip((np.asarray(t)[:, None] - spacing * place) / width, -1.0, 1.0)
        bump = np.polynomial.Polynomial([1.0, 0.0, -1.0]) ** 4
        columns = []
        for order in range(4):
            values = (bump if order == 0 else bump.deriv(order))(x) / width**order
            columns.append(np.hstack([np.full((len(x), 1), float(order == 0)), np.where(np.abs(x) < 1.0, values, 0.0)]))
        return Kinematics(*columns)


if __name__ == "__main__":
    design = oed.design(
        "er3a",
        model=oed.ModelOptions(friction="coulomb-viscous"),
        trajectory=oed.TrajectoryOptions(family=Bumps(count=10)),
        search=oed.SearchOptions(effort=oed.Effort(islands=1, starts=1, hops=0, finish_samples=100), workers=1),
    )
    print(design.summary())
