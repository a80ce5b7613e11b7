"""The fastest speeds along a path, by TOPP-RA's reachability analysis."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

import numpy as np
import toppra
from toppra.algorithm import TOPPRA
from toppra.constraint import (
    DiscretizationType,
    JointAccelerationConstraint,
    JointVelocityConstraint,
    JointVelocityConstraintVarying,
    LinearConstraint,
    canlinear_colloc_to_interpolate,
)

from oed.retiming.limits import too_weak_to_hold
from oed.retiming.paths import PathPiece
from robots.common.arrays import Array
from robots.common.errors import InfeasibleError
from robots.limits import Limits

InverseDynamics = Callable[[Array, Array, Array], Array]
Friction = Callable[[Array], Array]

_GRIDS = ((1.0, 0.9), (1.0, 0.5), (1.5, 0.9), (2.0, 0.5), (0.7, 0.0))
"""Cells over those asked for, and how much denser the ends are. Seidel's method, with its absolute tolerances, calls a
solvable linear programme infeasible now and then; on another grid it meets others."""

# Every failure is raised as one of our errors; the library's warnings would only repeat it.
logging.getLogger("toppra").setLevel(logging.ERROR)


class TorqueConstraint(LinearConstraint):
    """toppra's joint torque constraint for functions that take all grid points at once.

    tau = a(s) u + b(s) x + c(s) with x the squared path speed and u the path acceleration; friction is part of c, at
    the path speed of the solution before.

    Args:
        inverse_dynamics: (q, dq, ddq), (M, n) each, to torque without friction, (M, n) [N m].
        friction: dq (M, n) to the friction torque, (M, n) [N m].
        limit: largest torque, (n,) [N m].
    """

    def __init__(self, inverse_dynamics: InverseDynamics, friction: Friction | None, limit: Array) -> None:
        super().__init__()
        self.inverse_dynamics = inverse_dynamics
        self.friction = friction
        # Infinite torque limits would become infinite right-hand sides, which the solver does not take.
        self.limit = np.minimum(limit, 1e9)
        self.speed: Array | None = None
        self.dof = limit.size
        self.identical = True
        self.set_discretization_type(DiscretizationType.Interpolation)

    def compute_constraint_params(self, path: toppra.SplineInterpolator, gridpoints: Array) -> tuple[object, ...]:
        """Returns the coefficients a, b, c, F, g that toppra asks for, at the grid points (G+1,)."""
        q, slope, bend = path(gridpoints), path(gridpoints, 1), path(gridpoints, 2)
        still = np.zeros_like(q)
        c = self.inverse_dynamics(q, still, still)
        a = self.inverse_dynamics(q, still, slope) - c
        b = self.inverse_dynamics(q, slope, bend) - c
        if self.friction is not None:
            # At rest the direction of what follows decides, so that breakaway friction counts.
            speed = np.full(gridpoints.size, 1e-6) if self.speed is None else np.maximum(self.speed, 1e-6)
            c = c + self.friction(slope * speed[:, None])
        eye = np.eye(self.dof)
        return canlinear_colloc_to_interpolate(
            a, b, c, np.vstack([eye, -eye]), np.tile(self.limit, 2), None, None, gridpoints, identical=True
        )


class _SplinePath(toppra.SplineInterpolator):
    """Our spline in toppra's clothes: its own constructor would interpolate once more."""

    def __init__(self, piece: PathPiece) -> None:
        knots = np.array([0.0, piece.length])
        super().__init__(knots, piece.spline(knots))
        self.cspl = piece.spline
        self.cspld = piece.spline.derivative()
        self.cspldd = piece.spline.derivative(2)


def path_speed(piece: PathPiece, limits: Limits, torque: TorqueConstraint | None, cells: int) -> tuple[Array, Array]:
    """Finds the fastest path speeds within the limits, re-solved until friction and speed agree.

    Args:
        piece: the path.
        limits: finite bounds of velocity and acceleration.
        torque: the torque constraint, if torque is limited.
        cells: number of cells of the grid.

    Returns:
        The grid (G+1,) [s], and ds/dt there (G+1,), zero at both ends.

    Raises:
        InfeasibleError: no timing keeps the limits.
    """
    failure: InfeasibleError | None = None
    for more, clustering in _GRIDS:
        fraction = np.linspace(0.0, 1.0, int(more * cells) + 1)
        # Denser towards the ends, where the speed changes fastest along the path.
        grid = piece.length * (fraction - clustering * np.sin(2.0 * np.pi * fraction) / (2.0 * np.pi))
        grid[-1] = piece.length
        try:
            return grid, _with_friction(piece, limits, torque, grid)
        except InfeasibleError as error:
            failure = failure or error
    assert failure is not None
    raise failure


def _speed_constraint(path: _SplinePath, limits: Limits) -> Any:
    """Gives the velocity limits along a path, also those that depend on the position."""
    if limits.ramp is None:
        return JointVelocityConstraint(limits.velocity)

    def bounds(place: float) -> Array:
        q = path(place)
        upper, lower = (limits.speed_limit(q, np.full_like(q, sign)) for sign in (1.0, -1.0))
        return np.column_stack([-lower, upper])

    return JointVelocityConstraintVarying(bounds)


def _with_friction(piece: PathPiece, limits: Limits, torque: TorqueConstraint | None, grid: Array) -> Array:
    path = _SplinePath(piece)
    constraints = [_speed_constraint(path, limits), JointAccelerationConstraint(limits.acceleration)]
    if torque is None:
        return _solve(path, constraints, grid, None, limits)
    torque.speed = None
    constraints.append(torque)
    speed = _solve(path, constraints, grid, torque, limits)
    if torque.friction is None:
        return speed
    for _ in range(8):
        torque.speed = speed if torque.speed is None else (torque.speed + speed) / 2.0
        try:
            update = _solve(path, constraints, grid, torque, limits)
        except InfeasibleError:
            # Friction at a speed that is itself too high may leave no torque at all; half the speed leaves some.
            torque.speed = torque.speed / 2.0
            continue
        change = np.abs(update - speed).max() / speed.max()
        speed = update
        if change < 1e-3:
            break
    return speed


def _solve(
    path: _SplinePath,
    constraints: list[LinearConstraint],
    grid: Array,
    torque: TorqueConstraint | None,
    limits: Limits,
) -> Array:
    solver = TOPPRA(constraints, path, gridpoints=grid, solver_wrapper="seidel", parametrizer="ParametrizeConstAccel")
    trajectory = solver.compute_trajectory(0.0, 0.0)
    speed = None if trajectory is None else np.asarray(solver.problem_data.sd_vec, dtype=np.float64)
    if speed is None or not np.all(np.isfinite(speed)) or np.any(speed[:-1] + speed[1:] <= 0.0):
        raise _infeasible(path, grid, torque, limits)
    return speed


def _infeasible(path: _SplinePath, grid: Array, torque: TorqueConstraint | None, limits: Limits) -> InfeasibleError:
    if torque is not None:
        q, slope = path(grid), path(grid, 1)
        held = torque.inverse_dynamics(q, np.zeros_like(q), np.zeros_like(q))
        if torque.friction is not None:
            held = held + torque.friction(1e-6 * slope)
        weak = too_weak_to_hold(held, torque.limit, "gravity and friction alone need", limits)
        if weak is not None:
            return weak
    return InfeasibleError(
        "TOPP-RA finds no timing of this path within the limits", remedy="smooth the path, or check the limits"
    )
