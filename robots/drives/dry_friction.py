"""Velocities of joints with dry friction, which may hold them."""

from __future__ import annotations

import casadi

ROUNDS, NEWTON_ROUNDS, NEWTON_STEPS = 3, 3, 3
"""Gauss-Seidel rounds on the joints' coupled friction in each pass, those added in the last one, and the Newton steps
of each of these."""


def dry_velocity(
    rest: casadi.SX, inertia: casadi.SX, limit: casadi.SX, width: casadi.SX | float, newton: int
) -> casadi.SX:
    """Solves inertia z + limit tanh(z / width) = rest for z.

    With tanh straight-lined to a saturation the solution is exact and below the true one in size; from there Newton's
    steps grow towards it without overshooting, the left-hand side being concave beyond zero.

    Args:
        rest: torque without dry friction [N m].
        inertia: torque per velocity, above zero [N m s/rad].
        limit: size of dry friction, zero or more [N m].
        width: speed below which it fades [rad/s].
        newton: number of Newton steps.
    """
    stuck = rest / (inertia + limit / width)
    slipping = (rest - limit * casadi.sign(rest)) / inertia
    z = casadi.if_else(casadi.fabs(stuck) <= width, stuck, slipping)
    for _ in range(newton):
        share = casadi.tanh(z / width)
        z = z + (rest - inertia * z - limit * share) / (inertia + limit / width * (1 - share**2))
    return z


def dry_velocities(
    matrix: casadi.SX, right: casadi.SX, limits: casadi.SX, start: casadi.SX, width: casadi.SX | float, *, last: bool
) -> casadi.SX:
    """Solves matrix z + limits tanh(z / width) = right, joint after joint (Gauss-Seidel).

    Args:
        matrix: positive definite (n, n) [N m s/rad].
        right: (n,) [N m].
        limits: sizes of dry friction (n,) [N m].
        start: velocities to start from (n,) [rad/s].
        width: speed below which friction fades [rad/s].
        last: whether the solution is to be exact.
    """
    n = right.shape[0]
    z = [start[j] for j in range(n)]
    for index in range(ROUNDS + (NEWTON_ROUNDS if last else 0)):
        newton = NEWTON_STEPS if last and index >= ROUNDS else 0
        for j in range(n):
            rest = right[j] - sum((matrix[j, k] * z[k] for k in range(n) if k != j), start=casadi.SX(0))
            # A friction that drives would make the step ambiguous; on the way to a fit it may occur.
            z[j] = dry_velocity(rest, matrix[j, j], casadi.fmax(limits[j], 0), width, newton)
    return casadi.vertcat(*z)
