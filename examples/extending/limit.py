"""A limit of one's own: the flange moves no faster than a person beside the robot may be hit.

Run it with ``python limit.py``.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi
import numpy as np

import oed
from robots import Robot, load_robot


@dataclass(frozen=True, kw_only=True)
class FlangeSpeed(oed.StateLimit):
    """|velocity of the flange| <= largest.

    Attributes:
        largest: [m/s].
    """

    largest: float = 0.25

    def names(self, robot: Robot) -> tuple[str, ...]:
        """Names the one row."""
        return (f"flange speed {self.largest:g} m/s",)

    def rows(self, frames, dq: casadi.SX, ddq: casadi.SX) -> casadi.SX:
        """Writes speed^2 over its bound^2: smooth also where the flange stands still."""
        point = frames.flange_point(np.zeros(3))
        velocity = sum(frames.shift(joint, point) * dq[joint] for joint in range(frames.chain.n))
        return casadi.sumsqr(velocity) / self.largest**2


if __name__ == "__main__":
    robot = load_robot("er3a")
    design = oed.design(
        robot,
        model=oed.ModelOptions(friction="coulomb-viscous"),
        limits=oed.LimitOptions(motion=[FlangeSpeed(largest=0.5)]),
        trajectory=oed.TrajectoryOptions(strokes=False),
        search=oed.SearchOptions(effort=oed.Effort(islands=1, starts=1, hops=0, finish_samples=100), workers=1),
    )
    positions = robot.chain.transforms(design.motion.q)[:, -1, :3, 3]
    fastest = np.linalg.norm(np.diff(positions, axis=0), axis=1).max() / robot.period
    print(f"fastest flange: {fastest:.3f} m/s")
