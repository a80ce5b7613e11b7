"""Velocity limits that fall towards the ends of the joints, as smooth rows of a design."""

from __future__ import annotations

from dataclasses import dataclass

import casadi
import numpy as np

from oed.constraints.state import StateLimit
from robots.collision import Frames
from robots.limits import Limits
from robots.robot import Robot


@dataclass(frozen=True, kw_only=True, eq=False)
class VelocityRampLimit(StateLimit):
    """Keeps ``dq <= share (sqrt(2 a d) - c)``, with the distance d from an end and all that is taken off in c.

    A row is ``1 + (w |w| - 2 a d) / S`` with ``w = dq / share + c``: it is at most one where the limit holds, smooth,
    and defined also beyond the end. S is so large that the row stays above minus one.

    Attributes:
        limits: of the joints, with a ramp.
    """

    limits: Limits

    def names(self, robot: Robot) -> tuple[str, ...]:
        """See `StateLimit.names`."""
        return tuple(
            f"speed of joint {joint + 1} near its {end} end" for end in ("upper", "lower") for joint in range(robot.n)
        )

    def rows(self, frames: Frames, dq: casadi.SX, ddq: casadi.SX) -> casadi.SX:
        """See `StateLimit.rows`."""
        ramp = self.limits.ramp
        assert ramp is not None
        off = ramp.offset + ramp.reserve
        fastest = np.where(np.isfinite(self.limits.velocity), self.limits.velocity, 10.0) / ramp.share
        size = (fastest + off) ** 2 + 2 * ramp.deceleration * (ramp.upper - ramp.lower)
        rows = []
        for sign, distance in ((1.0, ramp.upper - frames.q), (-1.0, frames.q - ramp.lower)):
            w = sign * dq / ramp.share + off
            rows.append(1 + (w * casadi.fabs(w) - 2 * ramp.deceleration * distance) / size)
        return casadi.vertcat(*rows)
