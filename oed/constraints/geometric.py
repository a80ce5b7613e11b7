"""Limits in space as rows g(q) >= 0 with exact gradients."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, fields
from functools import cached_property

import casadi
import numpy as np
from numpy.typing import ArrayLike

from oed.constraints.pointwise import PointwiseLimit
from robots.batch import BatchFunction, batch_function
from robots.collision import CollisionModel, Frames, symbolic_frames
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.robot import Robot

Rows = tuple[casadi.SX, casadi.SX]  # g (m, 1) and its gradient (m, n)


class GeometricLimit(ABC):
    """One limit: rows g(q) that must not be negative."""

    @abstractmethod
    def names(self, robot: Robot) -> tuple[str, ...]:
        """Names the m rows for people.

        Args:
            robot: the robot that keeps the limit.
        """

    @abstractmethod
    def units(self, robot: Robot) -> tuple[str, ...]:
        """Gives the unit of each row.

        Args:
            robot: the robot that keeps the limit.
        """

    @abstractmethod
    def rows(self, frames: Frames) -> Rows:
        """Writes g (m, 1) and its gradient by q (m, n).

        Args:
            frames: the links' frames at q, symbolic.
        """

    def check(self, robot: Robot) -> None:  # noqa: B027 - most limits suit every robot
        """Refuses a robot that the limit does not suit.

        Raises:
            InputError: with what would.
        """


@dataclass(frozen=True, kw_only=True)
class CollisionLimit(GeometricLimit):
    """Every pair of bodies keeps a margin: smooth clearance - margin >= 0, never too large.

    Attributes:
        model: of the same robot.
        margin: to keep at the samples [m].
    """

    model: CollisionModel
    margin: float = 0.0

    def check(self, robot: Robot) -> None:
        """Refuses the model of another robot."""
        if self.model.chain.n != robot.n:
            raise InputError(f"a collision model of {self.model.name}", allowed=f"one of {robot.name}")

    def names(self, robot: Robot) -> tuple[str, ...]:
        """Names the pairs."""
        return self.model.names

    def units(self, robot: Robot) -> tuple[str, ...]:
        """All are lengths."""
        return ("m",) * len(self.model.pairs)

    def rows(self, frames: Frames) -> Rows:
        """Writes the clearances less the margin."""
        values, gradients = self.model.expression(frames)
        return values - self.margin, gradients


@dataclass(frozen=True, kw_only=True, eq=False)
class GeometricLimits(PointwiseLimit):
    """All limits in space of one robot, m rows in all, evaluated together.

    Values are in metres (a distance to singularity in its own unit): what a solver keeps between samples, and what it
    calls near, are millimetres and centimetres.

    Attributes:
        robot: the robot.
        limits: the limits.
        backend: see `robots.batch.batch_function`.
        labels: the rows' names (m,).
        units: the rows' units (m,).
        lower: zero, (m,).
        upper: infinite, (m,).

    Raises:
        InputError: a limit that does not suit the robot, such as the collision model of another.
    """

    robot: Robot
    limits: tuple[GeometricLimit, ...] = ()
    backend: str = "auto"
    name: str = field(default="geometry", init=False)
    labels: tuple[str, ...] = field(init=False)
    units: tuple[str, ...] = field(init=False)
    lower: Array = field(init=False)
    upper: Array = field(init=False)

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        set_(self, "limits", tuple(self.limits))
        for limit in self.limits:
            limit.check(self.robot)
        set_(self, "labels", tuple(name for limit in self.limits for name in limit.names(self.robot)))
        set_(self, "units", tuple(unit for limit in self.limits for unit in limit.units(self.robot)))
        set_(self, "lower", np.zeros(self.size))
        set_(self, "upper", np.full(self.size, np.inf))

    @property
    def size(self) -> int:
        """m, the number of rows."""
        return len(self.labels)

    def values(self, q: Array, dq: Array, ddq: Array) -> Array:
        """Evaluates g (N, m); velocity and acceleration do not matter."""
        rows = np.atleast_2d(np.asarray(q, dtype=np.float64))
        return self._values(rows)[0][:, :, 0] if self.size else np.empty((len(rows), 0))

    def jacobian(self, q: Array, dq: Array, ddq: Array) -> Array:
        """Evaluates the derivatives of g by q, dq and ddq (N, m, 3 n), zero by the latter two."""
        _, gradients = self.linearise(q)
        whole = np.zeros((*gradients.shape[:2], 3 * self.robot.n))
        whole[:, :, : self.robot.n] = gradients
        return whole

    def _expressions(self) -> tuple[casadi.SX, casadi.SX, casadi.SX]:
        frames = symbolic_frames(self.robot.chain)
        rows = [limit.rows(frames) for limit in self.limits]
        values = casadi.vertcat(casadi.SX(0, 1), *(value for value, _ in rows))
        return frames.q, values, casadi.vertcat(casadi.SX(0, self.robot.n), *(gradient for _, gradient in rows))

    def symbolic(self) -> casadi.Function:
        """Builds q (n) -> g (m, 1) and its gradient (m, n) as a CasADi function."""
        q, values, gradients = self._expressions()
        return casadi.Function("geometric", [q], [values, gradients], ["q"], ["g", "gradient"])

    def adjoint(self) -> casadi.Function:
        """Builds (q (n), gbar (m)) -> the gradient (n, 1) of gbar . g by q."""
        q, values, gradients = self._expressions()
        weights = casadi.SX.sym("gbar", values.shape[0])
        return casadi.Function("adjoint", [q, weights], [gradients.T @ weights], ["q", "gbar"], ["qbar"])

    @cached_property
    def _batch(self) -> BatchFunction:
        return batch_function(self.symbolic(), self.backend)

    @cached_property
    def _values(self) -> BatchFunction:
        # Without the gradients a third of the time.
        q, values, _ = self._expressions()
        return batch_function(casadi.Function("geometric_values", [q], [values]), self.backend)

    def linearise(self, q: ArrayLike) -> tuple[Array, Array]:
        """Evaluates all rows and their exact gradients at N samples.

        Row (k, r) of a solver's constraints has the value ``values[k, r]`` and, for q = B_k x at sample k, the gradient
        ``gradients[k, r] @ B_k`` by the coefficients x.

        Args:
            q: (N, n) [rad or m].

        Returns:
            values (N, m), feasible where they are not negative, and gradients (N, m, n) by rad or m.
        """
        rows = np.atleast_2d(np.asarray(q, dtype=np.float64))
        if not self.size:
            return np.empty((len(rows), 0)), np.empty((len(rows), 0, self.robot.n))
        values, gradients = self._batch(rows)
        return values[:, :, 0], gradients

    def pullback(self, q: ArrayLike, weights: Array) -> Array:
        """Derives ``sum(weights * g)`` by q.

        Args:
            q: (N, n) [rad or m].
            weights: (N, m), zero for rows that are not in the working set.

        Returns:
            (N, n).
        """
        _, gradients = self.linearise(q)
        return np.einsum("km,kmn->kn", weights, gradients)

    def __getstate__(self) -> dict[str, object]:
        # Compiled code is rebuilt in the process that needs it.
        return {item.name: getattr(self, item.name) for item in fields(self)}

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
