"""Where points of the arm may be: the tool within a box, a wrist on one side of a plane."""

from __future__ import annotations

from dataclasses import dataclass

import casadi
import numpy as np

from oed.constraints.geometric import GeometricLimit, Rows
from robots.collision import Frames
from robots.common.errors import InputError
from robots.robot import Robot


@dataclass(frozen=True, kw_only=True)
class ToolBox(GeometricLimit):
    """A point of the tool stays within a box along the axes of the base frame.

    Attributes:
        lower: lowest x, y and z (3,) [m]; -inf where there is no bound.
        upper: highest x, y and z (3,) [m]; inf where there is no bound.
        point: (3,) in the flange's frame [m]; the flange's origin by default.

    Raises:
        InputError: not three numbers each, or a box without inside.
    """

    lower: tuple[float, float, float]
    upper: tuple[float, float, float]
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for key in ("lower", "upper", "point"):
            value = np.asarray(getattr(self, key), dtype=np.float64)
            if value.shape != (3,) or np.isnan(value).any():
                raise InputError(f"the tool box's {key} is {value}", allowed="three numbers")
            object.__setattr__(self, key, tuple(float(x) for x in value))
        for axis, low, high in zip("xyz", self.lower, self.upper, strict=True):
            if not low < high:
                raise InputError(f"the tool box goes from {low} to {high} m in {axis}", allowed="lower < upper")

    def _sides(self) -> list[tuple[int, float, float]]:
        """Axis, sign and bound of each finite side."""
        sides = [
            (axis, sign, bounds[axis]) for axis in range(3) for sign, bounds in ((1, self.lower), (-1, self.upper))
        ]
        return [side for side in sides if np.isfinite(side[2])]

    def names(self, robot: Robot) -> tuple[str, ...]:
        """Names the finite sides."""
        return tuple(
            f"tool {'xyz'[axis]} {'>=' if sign > 0 else '<='} {bound:g}" for axis, sign, bound in self._sides()
        )

    def units(self, robot: Robot) -> tuple[str, ...]:
        """All are lengths."""
        return ("m",) * len(self._sides())

    def rows(self, frames: Frames) -> Rows:
        """Writes the distances within each finite side."""
        point = frames.flange_point(np.array(self.point))
        shifts = casadi.horzcat(*(frames.shift(joint, point) for joint in range(frames.chain.n)))
        sides = self._sides()
        values = casadi.vertcat(*(sign * (point[axis] - bound) for axis, sign, bound in sides))
        return values, casadi.vertcat(*(sign * shifts[axis, :] for axis, sign, _ in sides))


@dataclass(frozen=True, kw_only=True)
class PlaneLimit(GeometricLimit):
    """A point of a link stays on one side of a plane, such as the wrist above the table: normal . x - offset >= 0.

    Attributes:
        link: 1..n; the point is at its frame's origin plus `point`.
        normal: (3,) to the allowed side, in the base frame; it is normalised.
        offset: of the plane along it [m].
        point: (3,) in the link's frame [m].
        name: for people.

    Raises:
        InputError: a normal without length.
    """

    link: int
    normal: tuple[float, float, float]
    offset: float
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    name: str = ""

    def __post_init__(self) -> None:
        normal = np.asarray(self.normal, dtype=np.float64)
        length = float(np.linalg.norm(normal))
        if normal.shape != (3,) or not np.isfinite(length) or length < 1e-9 or self.link < 1:
            raise InputError(f"link {self.link} and the normal {normal}", allowed="a link from 1, a vector of length")
        object.__setattr__(self, "normal", tuple(float(x) for x in normal / length))

    def check(self, robot: Robot) -> None:
        """Refuses a link that the robot has not."""
        if self.link > robot.n:
            raise InputError(f"a plane for link {self.link}", allowed=f"1 to {robot.n}")

    def names(self, robot: Robot) -> tuple[str, ...]:
        """Names the row."""
        return (self.name or f"link {self.link} beyond plane",)

    def units(self, robot: Robot) -> tuple[str, ...]:
        """A length."""
        return ("m",)

    def rows(self, frames: Frames) -> Rows:
        """Writes the height above the plane."""
        point = frames.point(self.link, np.array(self.point))
        direction = casadi.SX(np.array(self.normal))
        gradient = casadi.SX(1, frames.chain.n)
        for joint in range(self.link):
            gradient[joint] = casadi.dot(direction, frames.shift(joint, point))
        return casadi.dot(direction, point) - self.offset, gradient
