"""Rigid-body dynamics of a serial chain by the Newton-Euler recursion, linear in ten parameters per link."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import casadi
import numpy as np
from numpy.typing import NDArray

from robots.geometry.chain import Joint
from robots.geometry.symbolic import cleaned, symbolic_placement
from robots.terms.base import Column, Term

if TYPE_CHECKING:
    from robots.robot import Robot

SYMBOLS = ("m", "mPx", "mPy", "mPz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
ZERO6 = casadi.SX(6, 1)
"""Angular velocity and acceleration of a base at rest."""
UNITS = ("kg",) + ("kg m",) * 3 + ("kg m2",) * 6


@dataclass(frozen=True)
class RigidBody(Term):
    """Inertia, Coriolis, centrifugal and gravity torque of the links (thesis eq. 4 to 33).

    The parameters of each link are its mass, first moments and inertia tensor about the link frame (eq. 3).
    """

    name: str = "rigid_body"

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Describes m, mPx, mPy, mPz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz, link by link."""
        return tuple(
            Column(name=f"{symbol}_{link}", symbol=symbol, joint=link, unit=unit, term=self.name)
            for link in range(1, robot.n + 1)
            for symbol, unit in zip(SYMBOLS, UNITS, strict=True)
        )

    def regressor(self, robot: Robot, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX) -> casadi.SX:
        """Builds Y (n, 10 n): only links from k outwards load joint k, so Y is block upper triangular."""
        return _rows(robot)(q, dq, ddq)

    def moving(
        self, robot: Robot, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX, base: casadi.SX | None = None
    ) -> casadi.SX:
        """Builds Y (n, 10 n) of a chain on a base that moves.

        Args:
            robot: the chain.
            q: positions (n,).
            dq: velocities (n,).
            ddq: accelerations (n,).
            base: acceleration of the base less gravity [m/s2], its angular velocity [rad/s] and acceleration [rad/s2]
                (9,), in its own frame; None for a base at rest as described.
        """
        return self.regressor(robot, q, dq, ddq) if base is None else _moving_rows(robot)(q, dq, ddq, base)

    def nominal(self, robot: Robot) -> NDArray[np.float64]:
        """Returns the inertial parameters of the robot's description, link by link (10 n,)."""
        return np.asarray(robot.inertia, dtype=float).reshape(-1)


@lru_cache(maxsize=8)
def _rows(robot: Robot) -> casadi.Function:
    """Builds the recursion as a function, once for all models of a robot."""
    q, dq, ddq = (casadi.SX.sym(name, robot.n) for name in ("q", "dq", "ddq"))
    still = casadi.SX(-cleaned(np.asarray(robot.chain.gravity, dtype=float)))
    return casadi.Function("rigid_body", [q, dq, ddq], [_recursion(robot, q, dq, ddq, casadi.vertcat(still, ZERO6))])


@lru_cache(maxsize=8)
def _moving_rows(robot: Robot) -> casadi.Function:
    """Builds the recursion from a base that moves (9,)."""
    q, dq, ddq = (casadi.SX.sym(name, robot.n) for name in ("q", "dq", "ddq"))
    base = casadi.SX.sym("base", 9)
    return casadi.Function("moving_body", [q, dq, ddq, base], [_recursion(robot, q, dq, ddq, base)])


def _recursion(robot: Robot, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX, base: casadi.SX) -> casadi.SX:
    chain = robot.chain
    rotations, translations = zip(
        *(symbolic_placement(joint, q[i]) for i, joint in enumerate(chain.joints)), strict=True
    )
    blocks = _link_wrenches(chain.joints, rotations, translations, base, dq, ddq)
    Y = casadi.SX(chain.n, 10 * chain.n)
    for link, block in enumerate(blocks):
        wrench = block  # (6, 10): force, then moment, of the link on its parent, in the frame of link k
        for k in range(link, -1, -1):
            joint = chain.joints[k]
            part = wrench[3:, :] if joint.kind == "revolute" else wrench[:3, :]
            Y[k, 10 * link : 10 * link + 10] = casadi.sparsify(casadi.SX(cleaned(joint.axis)).T @ part)
            if k:
                force = rotations[k] @ wrench[:3, :]
                moment = rotations[k] @ wrench[3:, :] + casadi.skew(translations[k]) @ force
                wrench = casadi.vertcat(force, moment)
    return Y


def _link_wrenches(
    joints: tuple[Joint, ...],
    rotations: tuple[casadi.SX, ...],
    translations: tuple[casadi.SX, ...],
    base: casadi.SX,
    dq: casadi.SX,
    ddq: casadi.SX,
) -> list[casadi.SX]:
    """Builds per link the map (6, 10) from parameters to inertial wrench by forward recursion (eq. 4 to 7, 23)."""
    acceleration, omega, alpha = base[:3], base[3:6], base[6:]
    blocks = []
    for i, joint in enumerate(joints):
        back, offset, axis = rotations[i].T, translations[i], casadi.SX(cleaned(joint.axis))
        acceleration = back @ (
            acceleration + casadi.cross(alpha, offset) + casadi.cross(omega, casadi.cross(omega, offset))
        )
        omega, alpha = back @ omega, back @ alpha
        if joint.kind == "revolute":
            alpha = alpha + casadi.cross(omega, axis) * dq[i] + axis * ddq[i]
            omega = omega + axis * dq[i]
        else:
            acceleration = acceleration + 2 * casadi.cross(omega, axis) * dq[i] + axis * ddq[i]
        blocks.append(_parameter_map(omega, alpha, acceleration))
    return blocks


def _parameter_map(omega: casadi.SX, alpha: casadi.SX, acceleration: casadi.SX) -> casadi.SX:
    spin = casadi.skew(omega)
    force = casadi.horzcat(acceleration, casadi.skew(alpha) + spin @ spin, casadi.SX(3, 6))
    moment = casadi.horzcat(casadi.SX(3, 1), -casadi.skew(acceleration), _dot(alpha) + spin @ _dot(omega))
    return casadi.vertcat(force, moment)


def _dot(vector: casadi.SX) -> casadi.SX:
    """Builds the (3, 6) matrix D of a vector v with I v = D [Ixx, Ixy, Ixz, Iyy, Iyz, Izz]."""
    x, y, z = vector[0], vector[1], vector[2]
    return casadi.sparsify(
        casadi.vertcat(
            casadi.horzcat(x, y, z, 0, 0, 0),
            casadi.horzcat(0, x, 0, y, z, 0),
            casadi.horzcat(0, 0, x, 0, y, z),
        )
    )
