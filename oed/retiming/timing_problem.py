"""How much of each limit a timing of a given path uses, and how that changes with the timing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PPoly

from oed.retiming.speed_law import Indices, SpeedGrid
from robots.common.arrays import Array
from robots.limits import Limits

InverseDynamics = Callable[[Array, Array, Array], Array]
Friction = Callable[[Array], Array]


@dataclass(frozen=True, kw_only=True, eq=False)
class Usage:
    """Use of limits at M points, and its derivatives.

    Args:
        values: quantity over limit of R rows a point, (M, R); within -1 and 1 is allowed.
        gradients: by the three spline coefficients of each point, (M, R, 3).
    """

    values: Array
    gradients: Array


class TimingProblem:
    """Velocity, acceleration, jerk and torque along q(s) as functions of the spline coefficients of x = (ds/dt)^2.

    ddq = q'' x + q' x'/2, dddq = sqrt(x) (q''' x + 3/2 q'' x' + 1/2 q' x''), and the torque is that of the rigid body,
    linear in x and x', plus friction at the speed q' sqrt(x). The velocity limits are one bound on x.

    Args:
        curve: the path q(s).
        grid: of the coefficients.
        points: number of equal cells in whose middles the limits hold.
        limits: finite velocity and acceleration; infinite jerks or torques are left out.
        inverse_dynamics: torque without friction, if torque is limited.
        friction: dq to the friction torque.
    """

    def __init__(
        self,
        curve: PPoly,
        grid: SpeedGrid,
        points: int,
        limits: Limits,
        inverse_dynamics: InverseDynamics | None,
        friction: Friction | None,
    ) -> None:
        self.grid = grid
        self.width = grid.length / points
        self.s: Array = self.width * (np.arange(points, dtype=np.float64) + 0.5)
        self.cell, self.b0, self.b1, self.b2 = grid.basis(self.s)
        self.columns: Indices = self.cell[:, None] + np.arange(3)
        d1, d2 = curve.derivative(), curve.derivative(2)
        # Means over a cell rather than values: the jerk between samples is a mean too.
        edges = self.width * np.arange(points + 1)
        slope, bend = d1(self.s), d2(self.s)
        third = np.diff(d2(edges), axis=0) / self.width
        with np.errstate(divide="ignore"):
            fastest = (limits.speed_limit(curve(self.s), slope) / np.maximum(np.abs(slope), 1e-150)) ** 2
        # Largest squared speed-up where nothing moves and so no limit says anything.
        self.ceiling = np.minimum(fastest.min(axis=1), 1e4)  # (M,), of x
        self.linear = _rows(bend, self.b0) + _rows(slope / 2, self.b1)  # acceleration
        self.linear /= limits.acceleration[None, :, None]
        self.jerk = _rows(third, self.b0) + _rows(1.5 * bend, self.b1) + _rows(slope / 2, self.b2)
        kept = np.isfinite(limits.jerk)
        self.jerk = self.jerk[:, kept] / limits.jerk[None, kept, None]
        self.torque: Array | None = None
        self.static = np.zeros((points, 0))
        self.friction, self.slope = friction, slope
        self.limited = np.isfinite(limits.torque) & (limits.torque > 0.0)
        self.torque_limit = limits.torque[self.limited]
        if inverse_dynamics is not None and self.limited.any():
            q, still = curve(self.s), np.zeros_like(slope)
            held = inverse_dynamics(q, still, still)
            a, b = inverse_dynamics(q, still, slope) - held, inverse_dynamics(q, slope, bend) - held
            rows = _rows(b, self.b0) + _rows(a / 2, self.b1)
            self.torque = rows[:, self.limited] / self.torque_limit[None, :, None]
            self.static = held[:, self.limited] / self.torque_limit
        count = self.linear.shape[1] + self.jerk.shape[1] + (0 if self.torque is None else self.torque.shape[1])
        self.allowed = np.ones((points, count))
        """Share of each limit that may be used, (M, R)."""

    def squared_speed(self, coefficients: Array) -> Array:
        """Gives x at the points, (M,)."""
        return np.einsum("mk,mk->m", self.b0, coefficients[self.columns])

    def values(self, coefficients: Array) -> Array:
        """Gives the use of the limits at positive x, (M, R)."""
        near = coefficients[self.columns]
        x = np.einsum("mk,mk->m", self.b0, near)
        parts = [
            np.einsum("mrk,mk->mr", self.linear, near),
            np.sqrt(x)[:, None] * np.einsum("mrk,mk->mr", self.jerk, near),
        ]
        if self.torque is not None:
            parts.append(self.static + np.einsum("mrk,mk->mr", self.torque, near) + self._losses(x))
        return np.hstack(parts) / self.allowed

    def usage(self, coefficients: Array) -> Usage:
        """Gives the use of the limits and its gradients."""
        near = coefficients[self.columns]
        x = np.einsum("mk,mk->m", self.b0, near)
        root = np.sqrt(x)[:, None]
        bare = np.einsum("mrk,mk->mr", self.jerk, near)
        values = [np.einsum("mrk,mk->mr", self.linear, near), root * bare]
        gradients = [self.linear, root[:, :, None] * self.jerk + _rows(bare / (2 * root), self.b0)]
        if self.torque is not None:
            losses, step = self._losses(x), 1e-6
            slope = (self._losses(x * (1 + step)) - losses) / (step * x[:, None])
            values.append(self.static + np.einsum("mrk,mk->mr", self.torque, near) + losses)
            gradients.append(self.torque + _rows(slope, self.b0))
        return Usage(
            values=np.hstack(values) / self.allowed,
            gradients=np.concatenate(gradients, axis=1) / self.allowed[:, :, None],
        )

    def _losses(self, x: Array) -> Array:
        if self.friction is None:
            return np.zeros((1, self.torque_limit.size))
        return self.friction(self.slope * np.sqrt(x)[:, None])[:, self.limited] / self.torque_limit


def _rows(factor: Array, basis: Array) -> Array:
    return factor[:, :, None] * basis[:, None, :]
