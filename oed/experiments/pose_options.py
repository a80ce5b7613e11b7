"""Which poses a calibration may measure, and what its instrument sees there."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any

from oed.experiments.options import usual_surroundings
from robots.common.errors import InputError
from robots.common.options import Option, Seed, names, numbers, point

if TYPE_CHECKING:
    import casadi
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from robots.collision import Surroundings
    from robots.geometry_errors import Measurement

    Array = NDArray[np.float64]
else:  # The options of the command line load without numerical libraries.
    ArrayLike = Measurement = Any

NOISE = {"m": 1e-4, "rad": 1e-4, "px": 0.2}
"""Usual noise of trackers, turn measurements and cameras."""


def _markers() -> Measurement:
    from robots.geometry_errors.measurements import Markers

    return Markers(count=3)


def _measurement(option: str, text: str) -> Measurement:
    from robots.geometry_errors import measurement_of

    return measurement_of(option, text)


@dataclass(frozen=True, kw_only=True)
class View:
    """An instrument that stands beside the robot.

    Attributes:
        origin: where the instrument stands, X,Y,Z in the base frame (3,) [m].
        towards: the point at which it looks, X,Y,Z in the base frame (3,). Default: it sees all around.
        cone: half-angle of its cone of view [deg].
        axis: direction of the flange in which markers face, X,Y,Z (3,): they are seen within 60 deg of it. Default:
            they are seen from all sides.
        facing: half-angle about that axis within which they are seen [rad].

    Raises:
        InputError: angles that are not between 0 and pi, or a direction of no length.
    """

    origin: Annotated[ArrayLike, Option(name="view-from", reads=point)]
    towards: Annotated[ArrayLike | None, Option(name="view-towards", reads=point)] = None
    cone: Annotated[float, Option(name="view-cone", degrees=True)] = math.pi / 6.0
    axis: Annotated[ArrayLike | None, Option(name="facing", reads=point)] = None
    facing: Annotated[float, Option(hidden=True)] = math.pi / 3.0

    def __post_init__(self) -> None:
        import numpy as np

        for name in ("cone", "facing"):
            if not 0.0 < getattr(self, name) <= math.pi:
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
        import numpy as np

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
        import casadi
        import numpy as np

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
        import numpy as np

        return {
            "origin": np.asarray(self.origin).tolist(),
            "towards": None if self.towards is None else np.asarray(self.towards).tolist(),
            "cone": self.cone,
            "axis": None if self.axis is None else np.asarray(self.axis).tolist(),
            "facing": self.facing,
        }


@dataclass(frozen=True, kw_only=True)
class PoseOptions:
    """Which poses are allowed, and what is measured.

    Attributes:
        measurement: what is measured: markers, markers:N, poses, distances, distances:N or inclinometer.
        kinds: kinds of errors to determine, comma-separated: joint_zero, link_placement, gear_ratio, eccentricity,
            joint_compliance, link_compliance.
        noise: standard deviation by unit: "m", "rad", "px"; or one number for each unit of the measurement.
        view: what the instrument sees; None for all.
        range_share: share of each joint's range that is used, around its middle.
        collision: keep the arm clear of itself, the floor and obstacles, at the poses and on the way.
        clearance: to keep [m].
        surroundings: the floor, and boxes that the arm must not enter.
        velocity_fraction: share of the velocity limits of the moves; see `LimitOptions`.
        home: pose at both ends (n,) [rad or m]; by default that of the limits, or a free one.
        dwell: time at each pose [s].
        refine: whether poses move freely after the exchange.
        seed: of the candidates.

    Raises:
        InputError: a share, clearance or time out of range, or noise that is not positive.
    """

    measurement: Annotated[Measurement, Option(reads=_measurement, typed="markers:3")] = field(default_factory=_markers)
    kinds: Annotated[tuple[str, ...], Option(reads=names)] = ("joint_zero", "link_placement")
    noise: Annotated[Mapping[str, float] | Sequence[float] | None, Option(reads=numbers)] = None
    view: View | None = None
    range_share: Annotated[float, Option(hidden=True)] = 0.9
    collision: bool = True
    clearance: float = 0.01
    surroundings: Surroundings = field(default_factory=usual_surroundings)
    velocity_fraction: float | None = None
    home: Annotated[ArrayLike | None, Option(reads=numbers, section="Robot")] = None
    dwell: Annotated[float, Option(hidden=True)] = 2.0
    refine: Annotated[bool, Option(hidden=True)] = True
    seed: Seed = 0

    def __post_init__(self) -> None:
        if not 0.0 < self.range_share <= 1.0:
            raise InputError(f"a share of {self.range_share:g} of the ranges", allowed="above 0, up to 1")
        if self.clearance < 0.0 or self.dwell <= 0.0:
            raise InputError(f"a clearance of {self.clearance:g} m and a dwell of {self.dwell:g} s", allowed="positive")

    @property
    def levels(self) -> dict[str, float]:
        """Noise of all units.

        Raises:
            InputError: noise that is not positive, or more numbers than units.
        """
        noise: Any = self.noise if self.noise is not None else {}
        if not isinstance(noise, Mapping):
            units = list(dict.fromkeys(self.measurement.units))
            if len(noise) > len(units):
                raise InputError(f"--noise with {len(noise)} numbers", allowed=f"one per unit: {', '.join(units)}")
            noise = dict(zip(units, noise, strict=False))
        if any(not value > 0.0 for value in noise.values()):
            raise InputError(f"noise of {noise}", allowed="positive numbers")
        return {**NOISE, **noise}
