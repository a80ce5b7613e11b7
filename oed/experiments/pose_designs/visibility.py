"""What an instrument sees: markers within its cone of view that face it."""

from __future__ import annotations

from dataclasses import dataclass

import casadi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from robots.common.errors import InputError

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class View:
    """An instrument that stands beside the robot.

    Attributes:
        origin: of the instrument in the base frame (3,) [m].
        towards: the point at which it looks, in the base frame (3,) [m]; None for one that sees all around.
        cone: half-angle of what it sees about that direction [rad].
        axis: of the flange along which its markers face (3,); None for markers that are seen from all sides.
        facing: half-angle about that axis within which they are seen [rad].

    Raises:
        InputError: angles that are not between 0 and pi, or a direction of no length.
    """

    origin: ArrayLike
    towards: ArrayLike | None = None
    cone: float = np.pi / 6.0
    axis: ArrayLike | None = None
    facing: float = np.pi / 3.0

    def __post_init__(self) -> None:
        for name in ("cone", "facing"):
            if not 0.0 < getattr(self, name) <= np.pi:
                raise InputError(f"a {name} of {getattr(self, name):g} rad", allowed="above 0, up to pi")
        for name in ("origin", "towards", "axis"):
            value = getattr(self, name)
            if value is not None:
                array = np.asarray(value, dtype=float)
                if array.shape != (3,) or not np.isfinite(array).all():
                    raise InputError(f"{name} of the view is {value}", allowed="three numbers")
                object.__setattr__(self, name, array)
        if self.axis is not None and not np.any(self.axis):
            raise InputError("the axis along which markers face has no length", allowed="a direction of the flange")
        if self.towards is not None and np.allclose(self.towards, self.origin):
            raise InputError("the instrument looks at itself", allowed="another point")

    def sees(self, flange: Array) -> NDArray[np.bool_]:
        """Says at which poses the flange's markers are seen (N,).

        Args:
            flange: poses of the flange in the base frame (N, 4, 4).
        """
        way = flange[:, :3, 3] - np.asarray(self.origin)
        way = way / np.maximum(np.linalg.norm(way, axis=1), 1e-12)[:, None]
        seen = np.ones(len(flange), dtype=bool)
        if self.towards is not None:
            direction = np.asarray(self.towards) - np.asarray(self.origin)
            seen &= way @ (direction / np.linalg.norm(direction)) >= np.cos(self.cone)
        if self.axis is not None:
            axis = np.asarray(self.axis) / np.linalg.norm(self.axis)
            seen &= np.sum((flange[:, :3, :3] @ axis) * -way, axis=1) >= np.cos(self.facing)
        return seen

    def expression(self, flange: casadi.SX) -> casadi.SX:
        """Writes what is not negative where the markers are seen.

        Args:
            flange: pose of the flange in the base frame (4, 4).
        """
        way, rows = flange[:3, 3] - casadi.SX(np.asarray(self.origin)), []
        distance = casadi.sqrt(casadi.dot(way, way) + 1e-12)
        if self.towards is not None:
            direction = np.asarray(self.towards) - np.asarray(self.origin)
            rows.append(casadi.dot(way, direction / np.linalg.norm(direction)) - np.cos(self.cone) * distance)
        if self.axis is not None:
            axis = flange[:3, :3] @ (np.asarray(self.axis) / np.linalg.norm(self.axis))
            rows.append(casadi.dot(axis, -way) - np.cos(self.facing) * distance)
        return casadi.vertcat(*rows) if rows else casadi.SX(0, 1)

    def settings(self) -> dict[str, object]:
        """Writes it as plain data."""
        return {
            "origin": np.asarray(self.origin).tolist(),
            "towards": None if self.towards is None else np.asarray(self.towards).tolist(),
            "cone": self.cone,
            "axis": None if self.axis is None else np.asarray(self.axis).tolist(),
            "facing": self.facing,
        }
