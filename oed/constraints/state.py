"""Limits of position, velocity and acceleration that a user writes as CasADi expressions."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, fields
from functools import cached_property

import casadi
import numpy as np

from oed.constraints.pointwise import PointwiseLimit
from robots.batch import BatchFunction, batch_function
from robots.collision import Frames, symbolic_frames
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.robot import Robot


class StateLimit(ABC):
    """Rows g(q, dq, ddq) that must stay between -1 and 1: each is a quantity over its own bound.

    A bound on one side is a row that never comes near the other one. A row must be smooth: sum of squares instead of
    its root. Members are frozen dataclasses, so that they travel to other processes.
    """

    @abstractmethod
    def names(self, robot: Robot) -> tuple[str, ...]:
        """Names the rows for people.

        Args:
            robot: the robot that keeps the limit.
        """

    @abstractmethod
    def rows(self, frames: Frames, dq: casadi.SX, ddq: casadi.SX) -> casadi.SX:
        """Writes the rows (m, 1).

        Args:
            frames: the links' frames at q, symbolic; `frames.q` are the positions.
            dq: joint velocities (n, 1) [rad/s or m/s].
            ddq: joint accelerations (n, 1) [rad/s2 or m/s2].
        """


@dataclass(frozen=True, kw_only=True, eq=False)
class StateLimits(PointwiseLimit):
    """All such limits of one robot, m rows in all, with exact derivatives.

    Attributes:
        robot: the robot.
        limits: the limits.
        labels: the rows' names (m,).
        lower: minus one (m,).
        upper: one (m,).

    Raises:
        InputError: a limit whose rows are not as many as its names.
    """

    robot: Robot
    limits: tuple[StateLimit, ...]
    name: str = field(default="motion", init=False)
    labels: tuple[str, ...] = field(init=False)
    lower: Array = field(init=False)
    upper: Array = field(init=False)

    def __post_init__(self) -> None:
        labels = tuple(name for limit in self.limits for name in limit.names(self.robot))
        object.__setattr__(self, "labels", labels)
        object.__setattr__(self, "lower", -np.ones(len(labels)))
        object.__setattr__(self, "upper", np.ones(len(labels)))
        for limit, (names, rows) in zip(self.limits, self._written[1], strict=True):
            if rows.shape != (len(names), 1):
                raise InputError(
                    f"the limit {limit!r} gives rows of shape {rows.shape}", allowed=f"({len(names)}, 1), as its names"
                )

    @cached_property
    def _written(self) -> tuple[list[casadi.SX], list[tuple[tuple[str, ...], casadi.SX]]]:
        n = self.robot.n
        frames, dq, ddq = symbolic_frames(self.robot.chain), casadi.SX.sym("dq", n), casadi.SX.sym("ddq", n)
        written = [(limit.names(self.robot), casadi.SX(limit.rows(frames, dq, ddq))) for limit in self.limits]
        return [frames.q, dq, ddq], written

    @cached_property
    def _functions(self) -> tuple[BatchFunction, BatchFunction]:
        symbols, written = self._written
        rows = casadi.densify(casadi.vertcat(*(row for _, row in written)))
        slope = casadi.densify(casadi.jacobian(rows, casadi.vertcat(*symbols)))
        return (
            batch_function(casadi.Function("limits", symbols, [rows])),
            batch_function(casadi.Function("slopes", symbols, [slope])),
        )

    def __getstate__(self) -> dict[str, object]:
        # Symbols and compiled code do not cross process borders.
        return {item.name: getattr(self, item.name) for item in fields(self)}

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)

    def values(self, q: Array, dq: Array, ddq: Array) -> Array:
        """Evaluates all rows on samples (M, n): (M, m)."""
        return self._functions[0](q, dq, ddq)[0][:, :, 0]

    def jacobian(self, q: Array, dq: Array, ddq: Array) -> Array:
        """Evaluates their derivatives by q, dq and ddq (M, m, 3 n)."""
        return self._functions[1](q, dq, ddq)[0]
