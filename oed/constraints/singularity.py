"""The distance to singular poses, in which the flange loses a direction."""

from __future__ import annotations

from dataclasses import dataclass

import casadi
import numpy as np

from oed.constraints.geometric import GeometricLimit, Rows
from robots.collision import Frames, reach
from robots.common.errors import InputError
from robots.robot import Robot

SINGULARITY_FLOOR = 1e-4  # e, which keeps the inverse finite in a singular pose


@dataclass(frozen=True, kw_only=True)
class SingularityLimit(GeometricLimit):
    """The arm stays away from singular poses: a smooth lower bound of the smallest singular value keeps a margin.

    Of the flange's Jacobian, its linear part divided by a characteristic length, so that all of it is in rad/rad, with
    the singular values sigma_i (m of them, m = min(6, n)):

        (sum_i (sigma_i^2 + e^2)^-2)^(-1/4) - e,    m^(-1/4) sigma_min - e <= it <= sigma_min,    e = 1e-4.

    Attributes:
        smallest: the value to keep [-].
        length: characteristic length [m]; by default half the arm's reach.

    Raises:
        InputError: a number that is not positive.
    """

    smallest: float
    length: float | None = None

    def __post_init__(self) -> None:
        if not self.smallest > 0.0 or not (self.length is None or self.length > 0.0):
            raise InputError(f"a singular value of {self.smallest}, a length of {self.length} m", allowed="above zero")

    def names(self, robot: Robot) -> tuple[str, ...]:
        """Names the row."""
        return ("distance to singularity",)

    def units(self, robot: Robot) -> tuple[str, ...]:
        """A number without unit, of the Jacobian scaled by the characteristic length."""
        return ("",)

    def rows(self, frames: Frames) -> Rows:
        """Writes the bound less what is to be kept."""
        length = self.length if self.length is not None else (reach(frames.chain) / 2.0 or 1.0)
        jacobian = flange_jacobian(frames, length)
        wide = jacobian.shape[0] <= jacobian.shape[1]
        square = casadi.mtimes(jacobian, jacobian.T) if wide else casadi.mtimes(jacobian.T, jacobian)
        inverse = _inverse(square + SINGULARITY_FLOOR**2 * casadi.SX.eye(square.shape[0]))
        value = casadi.sumsqr(inverse) ** -0.25 - SINGULARITY_FLOOR - self.smallest
        return value, casadi.jacobian(value, frames.q)


def flange_jacobian(frames: Frames, length: float) -> casadi.SX:
    """Writes the flange's Jacobian (6, n): linear part over `length` [m], then angular part [rad/rad]."""
    origin, columns = frames.flange_point(np.zeros(3)), []
    for joint, kind in enumerate(frames.chain.kinds):
        turn = frames.axes[joint] if kind == "revolute" else casadi.SX(3, 1)
        columns.append(casadi.vertcat(frames.shift(joint, origin) / length, turn))
    return casadi.horzcat(*columns)


def _inverse(matrix: casadi.SX) -> casadi.SX:
    """Inverts a symmetric positive definite matrix by its factors L D L'; casadi's own way by minors is far longer."""
    size = matrix.shape[0]
    lower = casadi.SX.eye(size)
    diagonal: list[casadi.SX] = []
    columns: list[casadi.SX] = []
    for j in range(size):
        diagonal.append(matrix[j, j] - sum(lower[j, k] ** 2 * diagonal[k] for k in range(j)))
        for i in range(j + 1, size):
            rest = matrix[i, j] - sum(lower[i, k] * lower[j, k] * diagonal[k] for k in range(j))
            lower[i, j] = rest / diagonal[j]
    for j in range(size):
        column = casadi.SX.eye(size)[:, j]
        for i in range(j + 1, size):
            column[i] = -sum(lower[i, k] * column[k] for k in range(j, i))
        columns.append(column)
    unit = casadi.horzcat(*columns)
    return unit.T @ casadi.diag(1.0 / casadi.vertcat(*diagonal)) @ unit
