"""Where the links are, as expressions in q."""

from __future__ import annotations

from dataclasses import dataclass

import casadi

from robots.common.arrays import Array
from robots.geometry.chain import Chain
from robots.geometry.symbolic import cleaned, symbolic_placement


@dataclass(frozen=True, eq=False)
class Frames:
    """A chain's frames in the base frame, as expressions; they do not pickle and live as long as a function's making.

    Attributes:
        chain: the chain.
        q: (n,) symbols [rad or m].
        rotations: n + 1 of (3, 3): of the base, then of each link.
        origins: n + 1 of (3,) [m].
        axes: n of (3,): each joint's axis.
    """

    chain: Chain
    q: casadi.SX
    rotations: tuple[casadi.SX, ...]
    origins: tuple[casadi.SX, ...]
    axes: tuple[casadi.SX, ...]

    def point(self, link: int, position: Array) -> casadi.SX:
        """Places a point (3,) [m] that is fixed in a link's frame (0: the base) in the base frame."""
        return self.origins[link] + self.rotations[link] @ casadi.sparsify(casadi.SX(cleaned(position)))

    def flange_point(self, position: Array) -> casadi.SX:
        """Places a point (3,) [m] that is fixed in the flange's frame in the base frame."""
        tip = self.chain.tip
        return self.point(self.chain.n, tip[:3, 3] + tip[:3, :3] @ position)

    def shift(self, joint: int, point: casadi.SX) -> casadi.SX:
        """Derives a point (3,) of a link beyond a joint (from 0) by that joint's position: (3,) [m/rad or m/m]."""
        axis = self.axes[joint]
        if self.chain.joints[joint].kind == "prismatic":
            return axis
        return casadi.cross(axis, point - self.origins[joint + 1])


def symbolic_frames(chain: Chain) -> Frames:
    """Builds the frames of a chain over fresh symbols q."""
    q = casadi.SX.sym("q", chain.n)
    rotations, origins, axes = [casadi.SX.eye(3)], [casadi.SX(3, 1)], []
    for i, joint in enumerate(chain.joints):
        rotation, origin = symbolic_placement(joint, q[i])
        origins.append(origins[-1] + rotations[-1] @ origin)
        rotations.append(casadi.sparsify(rotations[-1] @ rotation))
        axes.append(rotations[-1] @ casadi.sparsify(casadi.SX(cleaned(joint.axis))))
    return Frames(chain, q, tuple(rotations), tuple(origins), tuple(axes))
